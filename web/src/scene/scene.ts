/** The track and all cars of a batch in 3D. Loaded when it is shown; draws only what has changed, in a handful of draw
 * calls, no frame while nothing moves, and while it moves only as sharp as the machine can at a good pace. */
import * as three from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { TrackGeometry } from "../api/client";
import { CAR_TONE, hueOf } from "../lib/colors";
import { boxGeometry } from "./box";
import { carGeometry } from "./car";
import { standBack } from "./fit";
import { RISE, roadGeometry } from "./ground";
import { DAY, landscapeGeometry, NIGHT, skyGeometry } from "./landscape";
import { Pace } from "./pace";
import { Paint } from "./paint";
import { between, halfway, type Look } from "./poses";
import { Sharpness } from "./sharpness";

export type View = "orbit" | "follow" | "top" | "chase" | "driver";

/** A car that is put somewhere, rather than streamed. */
export interface PlacedCar {
  x: number;
  y: number;
  heading: number;
  /** CSS colour of its body. */
  color: string;
}

/** Something on the road that does not learn: a box, or another car. */
export interface PlacedObject {
  kind: string;
  x: number;
  y: number;
  heading: number;
}

/** A line on the ground with a colour at every point. */
export interface Trail {
  points: number[][];
  colors: string[];
}

const MAX_CARS = 256;
const MAX_OBJECTS = 40; // that may be around a car
const BOT = new three.Color(0xd9dde3);
const BOX = new three.Color(0xffffff);
const COARSEST = 0.7; // pixels per CSS pixel, along a side
const LATE = 1.4; // times the usual, after which the next look at the latest is expected
const SPARING = 25; // ms between two frames that the processor draws
const STILL = 400; // ms without a change, after which the picture is drawn as sharp as it can be

/** Whether WebGL is drawn by the processor: smooth edges would cost it more than everything else. */
function isSoftware(): boolean {
  const context = document.createElement("canvas").getContext("webgl2");
  if (!context) return false;
  const name = context.getExtension("WEBGL_debug_renderer_info")?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER;
  const renderer = String(context.getParameter(name));
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(renderer);
}

export class Scene {
  private readonly renderer: three.WebGLRenderer;
  private readonly scene = new three.Scene();
  private readonly camera = new three.PerspectiveCamera(42, 1, 0.05, 300);
  private readonly controls: OrbitControls;
  private readonly cars: three.InstancedMesh;
  private readonly boxes: three.InstancedMesh;
  private readonly bots: three.InstancedMesh;
  private readonly land: three.Mesh;
  private readonly sky: three.Mesh;
  private readonly paints = new Paint();
  private readonly pace: Pace;
  private readonly sharpness: Sharpness;
  private readonly middle = new three.Vector3();
  private readonly size: number;
  private readonly edges: (readonly [number, number, number])[]; // of the road, from the middle
  private isMoved = false; // the camera, by hand: it then stays where it is
  private readonly matrix = new three.Matrix4();
  private readonly watcher: ResizeObserver;
  private before: Look | undefined;
  private now: Look | undefined;
  private arrived = 0;
  private interval = 100; // ms between looks, lately
  private view: View = "orbit";
  private frame = 0;
  private isDirty = true;
  private drawn = 0; // when, in ms
  private isSharp = false;
  private isTimed = false; // the frame drawn last, by the next one of the screen
  private placed: PlacedCar[] | undefined;
  private readonly trails = new three.Group();

  constructor(
    private readonly canvas: HTMLCanvasElement,
    track: TrackGeometry,
    private readonly isCalm: boolean,
  ) {
    const isSlow = isSoftware();
    const finest = Math.min(devicePixelRatio, 2);
    this.renderer = new three.WebGLRenderer({ canvas, antialias: !isSlow, powerPreference: "high-performance" });
    this.pace = new Pace(isSlow ? SPARING : 0);
    this.sharpness = new Sharpness(finest, COARSEST, isSlow ? 0.85 : finest);
    this.renderer.setPixelRatio(this.sharpness.ratio);
    this.camera.up.set(0, 0, 1);
    const box = new three.Box2().setFromPoints(
      [...track.outer, ...track.inner].map(([x, y]) => new three.Vector2(x, y)),
    );
    const [center, extent] = [box.getCenter(new three.Vector2()), box.getSize(new three.Vector2())];
    this.middle.set(center.x, center.y, 0);
    this.size = Math.max(extent.x, extent.y * 1.5);
    this.edges = [...track.outer, ...track.inner].map(([x, y]) => [x! - center.x, y! - center.y, 0]);

    // drawn in this order: what is hidden by something nearer then costs no pixel
    this.cars = new three.InstancedMesh(carGeometry(), this.paints, MAX_CARS);
    this.cars.count = 0;
    this.cars.setColorAt(0, new three.Color());
    this.cars.instanceMatrix.setUsage(three.DynamicDrawUsage);
    this.boxes = new three.InstancedMesh(boxGeometry(), this.paints, MAX_OBJECTS);
    this.bots = new three.InstancedMesh(this.cars.geometry, this.paints, MAX_OBJECTS);
    for (const [mesh, color] of [
      [this.boxes, BOX],
      [this.bots, BOT],
    ] as const) {
      mesh.count = 0;
      for (let index = 0; index < MAX_OBJECTS; index++) mesh.setColorAt(index, color);
    }
    const road = new three.Mesh(roadGeometry(track), this.paints);
    this.land = new three.Mesh(new three.BufferGeometry(), this.paints);
    this.land.position.copy(this.middle);
    const air = new three.MeshBasicMaterial({ vertexColors: true, side: three.BackSide, depthWrite: false });
    this.sky = new three.Mesh(new three.BufferGeometry(), air);
    for (const [order, mesh] of [this.cars, this.boxes, this.bots, road, this.land, this.sky].entries()) {
      mesh.renderOrder = order;
      mesh.frustumCulled = false;
      this.scene.add(mesh);
    }

    this.scene.add(this.trails);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.maxPolarAngle = 1.5;
    this.controls.addEventListener("start", () => (this.isMoved = true));
    this.controls.addEventListener("change", () => this.wake());
    this.reset();
    this.watcher = new ResizeObserver(() => this.resize());
    this.watcher.observe(canvas);
    this.resize();
    this.wake();
  }

  /** Something has changed: frames are drawn until nothing moves any more. */
  private wake(): void {
    this.isDirty = true;
    this.frame ||= requestAnimationFrame(this.draw);
  }

  /** The newest moment. */
  show(look: Look): void {
    const time = performance.now();
    const from = this.now && halfway(this.before, this.now, this.share(time));
    if (this.now) this.interval += 0.2 * (Math.min(time - this.arrived, 1000) - this.interval);
    [this.before, this.now, this.arrived] = [from, look, time];
    if (look.objects?.length || this.boxes.count || this.bots.count)
      this.furnish(
        (look.objects ?? []).map(([kind, x, y, heading]) => ({
          kind,
          x: x / 1000,
          y: y / 1000,
          heading: heading / 1000,
        })),
      );
    this.wake();
  }

  /** What is on the road besides; how many of it the canvas says, too. */
  furnish(objects: PlacedObject[]): void {
    for (const [mesh, own] of [
      [this.boxes, objects.filter((one) => one.kind === "box")],
      [this.bots, objects.filter((one) => one.kind !== "box")],
    ] as const) {
      mesh.count = Math.min(own.length, MAX_OBJECTS);
      own.slice(0, MAX_OBJECTS).forEach(({ x, y, heading }, index) => {
        this.matrix.makeRotationZ(heading).setPosition(x, y, 2 * RISE);
        mesh.setMatrixAt(index, this.matrix);
      });
      mesh.instanceMatrix.needsUpdate = true;
    }
    this.canvas.dataset["boxes"] = String(this.boxes.count);
    this.canvas.dataset["bots"] = String(this.bots.count);
    this.wake();
  }

  /** Put cars somewhere at once; the camera follows the first one. */
  put(cars: PlacedCar[]): void {
    this.placed = cars;
    this.wake();
  }

  /** Draw lines on the ground, instead of those before. */
  drawTrails(trails: Trail[]): void {
    this.clearTrails();
    for (const { points, colors } of trails) {
      const geometry = new three.BufferGeometry();
      geometry.setAttribute(
        "position",
        new three.Float32BufferAttribute(
          points.flatMap(([x, y]) => [x!, y!, 4 * RISE]),
          3,
        ),
      );
      const tints = colors.flatMap((css) => new three.Color(css).toArray() as number[]);
      geometry.setAttribute("color", new three.Float32BufferAttribute(tints, 3));
      this.trails.add(new three.Line(geometry, new three.LineBasicMaterial({ vertexColors: true })));
    }
    this.wake();
  }

  private clearTrails(): void {
    for (const line of [...this.trails.children] as three.Line[]) {
      line.geometry.dispose();
      (line.material as three.Material).dispose();
      this.trails.remove(line);
    }
  }

  /** From where to look. */
  watch(view: View): void {
    this.view = view;
    this.controls.enabled = view === "orbit";
    this.isMoved = false;
    this.reset();
  }

  paint(isDark: boolean): void {
    const palette = isDark ? NIGHT : DAY;
    const horizon = new three.Color(palette.horizon);
    this.scene.background = horizon;
    this.paints.fade(horizon, this.size * 1.6, this.size * 6.5);
    const edges = this.edges.map(([x, y]) => [x, y] as const);
    for (const [mesh, geometry] of [
      [this.land, landscapeGeometry(this.size, edges, palette)],
      [this.sky, skyGeometry(0.95 * this.camera.far, palette)],
    ] as const) {
      mesh.geometry.dispose();
      mesh.geometry = geometry;
    }
    this.wake();
  }

  close(): void {
    cancelAnimationFrame(this.frame);
    this.watcher.disconnect();
    this.controls.dispose();
    this.clearTrails();
    this.scene.traverse((thing) => {
      if (thing instanceof three.Mesh) (thing.geometry as three.BufferGeometry).dispose();
    });
    for (const mesh of [this.cars, this.boxes, this.bots]) mesh.dispose();
    this.paints.dispose();
    (this.sky.material as three.Material).dispose();
    this.renderer.dispose();
  }

  private reset(): void {
    const { x, y } = this.middle;
    this.controls.target.copy(this.middle);
    const back = (
      this.view === "top" ? new three.Vector3(0, -0.001, 1) : new three.Vector3(0, -0.72, 0.62)
    ).normalize();
    const up = new three.Vector3(0, back.z, -back.y);
    const tangent = Math.tan((this.camera.fov * Math.PI) / 360);
    const view = { back: back.toArray(), right: [1, 0, 0], up: up.toArray() } as const;
    const distance = standBack(this.edges, view, tangent, this.camera.aspect);
    this.camera.position.set(x + distance * back.x, y + distance * back.y, distance * back.z);
    this.camera.lookAt(this.middle);
    this.wake();
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.fov = Math.min(70, 42 * Math.max(1, 1.45 / this.camera.aspect));
    this.camera.updateProjectionMatrix();
    if (!this.isMoved && (this.view === "orbit" || this.view === "top")) this.reset();
    this.wake();
  }

  /** Of the way to the newest look, 0 to 1; they come unevenly, and the cars had better not stop before a late one. */
  private share(time: number): number {
    return this.isCalm ? 1 : Math.min(Math.max(time - this.arrived, 0) / (LATE * this.interval), 1);
  }

  private readonly draw = (time: number): void => {
    this.frame = 0;
    const share = this.share(time);
    const isMoving = this.now !== undefined && !this.isCalm && time - this.arrived < LATE * this.interval + 50;
    if (isMoving || this.isDirty) {
      if (this.isTimed && time - this.drawn < STILL) this.sharpness.took(time - this.drawn);
      this.isTimed = this.isSharp = false;
      if (this.pace.isDue(time)) {
        this.sharpen(this.sharpness.ratio);
        this.render(share);
        [this.drawn, this.isTimed] = [time, true];
      }
    } else if (!this.isSharp && time - this.drawn > STILL) {
      this.sharpen(this.sharpness.finest);
      this.isSharp = true;
      this.render(share);
    }
    if (!this.isSharp) this.frame ||= requestAnimationFrame(this.draw);
  };

  private sharpen(ratio: number): void {
    if (ratio !== this.renderer.getPixelRatio()) this.renderer.setPixelRatio(ratio);
  }

  private render(share: number): void {
    this.isDirty = false;
    if (this.placed) this.placeCars(this.placed);
    else if (this.now) this.place(between(this.before, this.now, share));
    this.sky.position.copy(this.camera.position);
    this.renderer.render(this.scene, this.camera);
  }

  private place(poses: ReturnType<typeof between>): void {
    this.cars.count = Math.min(poses.length, MAX_CARS);
    const colour = new three.Color();
    let leader = 0;
    poses.slice(0, MAX_CARS).forEach((pose, car) => {
      if (pose.progress > poses[leader]!.progress) leader = car;
      this.matrix.makeRotationZ(pose.heading).setPosition(pose.x, pose.y, 2 * RISE);
      this.cars.setMatrixAt(car, this.matrix);
      const tint = this.now?.tints?.[car];
      this.cars.setColorAt(
        car,
        tint !== undefined
          ? colour.setHex(tint)
          : colour.setHSL(hueOf(pose.progress), CAR_TONE.saturation, CAR_TONE.lightness),
      );
    });
    leader = this.now?.focus ?? leader;
    this.cars.instanceMatrix.needsUpdate = true;
    if (this.cars.instanceColor) this.cars.instanceColor.needsUpdate = true;
    if (poses[leader]) this.ride(leader, poses[leader]!);
  }

  private placeCars(cars: PlacedCar[]): void {
    this.cars.count = Math.min(cars.length, MAX_CARS);
    const colour = new three.Color();
    cars.slice(0, MAX_CARS).forEach((car, index) => {
      this.matrix.makeRotationZ(car.heading).setPosition(car.x, car.y, (2 + index) * RISE);
      this.cars.setMatrixAt(index, this.matrix);
      this.cars.setColorAt(index, colour.set(car.color));
    });
    this.cars.instanceMatrix.needsUpdate = true;
    if (this.cars.instanceColor) this.cars.instanceColor.needsUpdate = true;
    if (cars[0]) this.ride(0, cars[0]);
  }

  /** Move the camera with a car, where the view asks for it. */
  private ride(car: number, { x, y, heading }: { x: number; y: number; heading: number }): void {
    if (this.view === "driver") {
      this.matrix.makeScale(0, 0, 0);
      this.cars.setMatrixAt(car, this.matrix); // the driver does not see the own car
      this.camera.position.set(x + 0.05 * Math.cos(heading), y + 0.05 * Math.sin(heading), 0.2);
      this.camera.lookAt(x + 1.2 * Math.cos(heading), y + 1.2 * Math.sin(heading), 0.02);
    } else if (this.view === "chase") {
      const wanted = new three.Vector3(x - 0.85 * Math.cos(heading), y - 0.85 * Math.sin(heading), 0.42);
      this.camera.position.lerp(wanted, this.isCalm || this.camera.position.distanceTo(wanted) > 4 ? 1 : 0.3);
      this.camera.lookAt(x + 1.3 * Math.cos(heading), y + 1.3 * Math.sin(heading), 0.05);
    } else if (this.view === "follow") {
      const wanted = new three.Vector3(x - 1.5 * Math.cos(heading), y - 1.5 * Math.sin(heading), 0.85);
      const away = this.camera.position.distanceTo(wanted);
      this.camera.position.lerp(wanted, this.isCalm || away > 4 ? 1 : 0.12);
      this.camera.lookAt(x + 0.5 * Math.cos(heading), y + 0.5 * Math.sin(heading), 0.1);
      if (away > 0.02) this.wake(); // until it has arrived, also where the car stands
    }
  }
}
