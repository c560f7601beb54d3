/** The models of this browser as the page shows them. One for which the storage has no room stays as long as the page is open, and is kept once
 * there is some. */
import type { Model } from "./model";
import { drop, freeName, keep, keepNew, kept, rename } from "./shelf";

export class Garage {
  /** Newest first. */
  models = $state.raw<Model[]>([]);
  private stored: Model[] = [];
  private unkept: Model[] = []; // newer than what is stored of them

  /** `onUnkept`: is told why a model could not be kept. */
  constructor(private readonly onUnkept: (error: unknown) => void) {}

  /** Whether some of them are gone with the page. */
  get hasUnkept(): boolean {
    return this.unkept.length > 0;
  }

  /** Look at what is there; other tabs keep and delete, too. */
  async list(): Promise<void> {
    this.stored = await kept();
    this.show();
  }

  /** Keep a model, instead of one of the same name. */
  async keep(model: Model): Promise<void> {
    try {
      await keep(model);
      this.forget(model.name);
      await this.list();
    } catch (error) {
      this.hold(model, error);
    }
  }

  /** Keep a model under the first name that is free, and tell which: `nameOf` gives them, from 1. */
  async keepNew(model: Model, nameOf: (number: number) => string): Promise<string> {
    try {
      const name = await keepNew(
        model,
        nameOf,
        this.unkept.map(({ name }) => name),
      );
      await this.list();
      return name;
    } catch (error) {
      const taken = this.models.map(({ name }) => name);
      const name = freeName(nameOf, taken);
      this.hold({ ...model, name }, error);
      return name;
    }
  }

  /** Give a model another name; false where another one has it. */
  async rename(model: Model, name: string): Promise<boolean> {
    if (this.models.some((one) => one.name === name)) return false;
    try {
      await rename(model, name);
    } catch (error) {
      if ((error as Error).name === "ConstraintError") return false; // another tab kept one under it, a moment ago
      if (!this.unkept.includes(model)) throw error;
      this.forget(model.name);
      this.unkept.push({ ...model, name });
      this.show();
      return true;
    }
    this.forget(model.name);
    await this.list();
    return true;
  }

  async drop(name: string): Promise<void> {
    let isOther = this.stored.some((one) => one.name === name); // than it was, what is stored
    if (isOther) await drop(name);
    this.forget(name);
    this.show();
    for (const model of this.unkept)
      await keep(model).then(
        () => {
          this.forget(model.name);
          isOther = true;
        },
        () => undefined, // there still is no room
      );
    if (isOther) await this.list();
  }

  private forget(of: string): void {
    this.unkept = this.unkept.filter(({ name }) => name !== of);
  }

  private hold(model: Model, error: unknown): void {
    this.forget(model.name);
    this.unkept.push(model);
    this.show();
    this.onUnkept(error);
  }

  private show(): void {
    const others = this.stored.filter(({ name }) => !this.unkept.some((one) => one.name === name));
    this.models = [...this.unkept, ...others].sort((a, b) => b.created.localeCompare(a.created));
  }
}
