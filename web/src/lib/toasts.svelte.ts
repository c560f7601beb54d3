/** Short messages at the edge of the page; an error stays until it is closed. */
import { Problem } from "../api/client";

export interface Toast {
  id: number;
  text: string;
  hint: string;
  isError: boolean;
  action: { label: string; run: () => void } | undefined;
}

export const toasts = $state<Toast[]>([]);
let next = 0;

/** `stays`: until it is closed. */
export function say(text: string, action?: Toast["action"], stays = false): void {
  const id = next++;
  toasts.push({ id, text, hint: "", isError: false, action });
  if (!stays) setTimeout(() => close(id), 8000);
}

export function fail(error: unknown): void {
  if (error instanceof Problem && error.code === "NotSignedIn") return; // a page of its own says it
  const hint = error instanceof Problem ? error.hint : "";
  const text = error instanceof Error ? error.message : String(error);
  const same = toasts.find((toast) => toast.text === text && toast.hint === hint);
  if (same) return; // once is enough
  toasts.push({ id: next++, text, hint, isError: true, action: undefined });
}

export function close(id: number): void {
  const index = toasts.findIndex((toast) => toast.id === id);
  if (index >= 0) toasts.splice(index, 1);
}
