/** The track and all cars of a batch in 3D. Loaded when it is shown; draws only what has changed. */
import * as three from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import type { TrackGeometry } from "../api/client";
import { between, type Look } from "./poses";

export type View = "orbit" | "follow" | "top" | "chase" | "driver";

/** A car that is put somewhere, rather than streamed. */
export interface PlacedCar {
  x: number;
  y: number;
  heading: number;
  /** CSS colour of its body. */
  color: string;
}

/** A line on the ground with a colour at every point. */
export interface Trail {
  points: number[][];
  colors: string[];
}

const LINE = 0.0762; // m, width of the white lines
const MAX_CARS = 256;
const RISE = 0.004; // m between layers, so that none shows through another

type Points = number[][];

/** A band between two lines of the same number of points. */
function band(from: Points, to: Points, isClosed: boolean, height: number): three.BufferGeometry {
  const positions = from.flatMap((point, index) => [point[0]!, point[1]!, height, to[index]![0]!, to[index]![1]!, height]);
  const indices: number[] = [];
  const last = isClosed ? from.length : from.length - 1;
  for (let index = 0; index < last; index++) {
    const [a, b] = [2 * index, 2 * ((index + 1) % from.length)];
    indices.push(a, b, a + 1, b, b + 1, a + 1);
  }
  const geometry = new three.BufferGeometry();
  geometry.setAttribute("position", new three.Float32BufferAttribute(positions, 3));
  geometry.setIndex(indices);
  return geometry;
}

/** A line moved towards another by a width in metres. */
const inward = (line: Points, other: Points, width: number): Points =>
  line.map((point, index) => {
    const [dx, dy] = [other[index]![0]! - point[0]!, other[index]![1]! - point[1]!];
    const share = width / Math.max(Math.hypot(dx, dy), 1e-6);
    return [point[0]! + dx * share, point[1]! + dy * share];
  });

/** Dashes along the middle. */
function dashes(center: Points, isClosed: boolean): three.BufferGeometry {
  const pieces: three.BufferGeometry[] = [];
  const line = isClosed ? [...center, center[0]!] : center;
  let next = 0;
  let walked = 0;
  for (let index = 0; index + 1 < line.length; index++) {
    const [a, b] = [line[index]!, line[index + 1]!];
    const length = Math.hypot(b[0]! - a[0]!, b[1]! - a[1]!);
    for (; next < walked + length; next += 0.24) {
      const share = (next - walked) / length;
      const piece = new three.PlaneGeometry(0.12, 0.03);
      piece.rotateZ(Math.atan2(b[1]! - a[1]!, b[0]! - a[0]!));
      piece.translate(a[0]! + (b[0]! - a[0]!) * share, a[1]! + (b[1]! - a[1]!) * share, 2 * RISE);
      pieces.push(piece);
    }
    walked += length;
  }
  return mergeGeometries(pieces);
}

/** A small racing car of boxes and wheels, coloured per vertex; the body is white, to be tinted per car. */
function carGeometry(): three.BufferGeometry {
  const parts: three.BufferGeometry[] = [];
  const add = (geometry: three.BufferGeometry, colour: number, x: number, y: number, z: number) => {
    geometry.translate(x, y, z);
    const tint = new three.Color(colour);
    const count = geometry.getAttribute("position").count;
    geometry.setAttribute("color", new three.Float32BufferAttribute(Array.from({ length: count }, () => [tint.r, tint.g, tint.b]).flat(), 3));
    geometry.deleteAttribute("uv");
    parts.push(geometry.toNonIndexed());
  };
  add(new three.BoxGeometry(0.3, 0.15, 0.06), 0xffffff, 0, 0, 0.07);
  add(new three.BoxGeometry(0.13, 0.12, 0.06), 0x20242a, -0.03, 0, 0.125);
  add(new three.BoxGeometry(0.02, 0.19, 0.02), 0xffffff, -0.15, 0, 0.14);
  for (const x of [-0.085, 0.085])
    for (const y of [-0.085, 0.085]) add(new three.CylinderGeometry(0.038, 0.038, 0.034, 12), 0x15181c, x, y, 0.038);
  return mergeGeometries(parts);
}

export class Scene {
  private readonly renderer: three.WebGLRenderer;
  private readonly scene = new three.Scene();
  private readonly camera = new three.PerspectiveCamera(42, 1, 0.05, 300);
  private readonly controls: OrbitControls;
  private readonly cars: three.InstancedMesh;
  private readonly field: three.MeshLambertMaterial;
  private readonly middle = new three.Vector3();
  private readonly size: number;
  private readonly matrix = new three.Matrix4();
  private readonly watcher: ResizeObserver;
  private before: Look | undefined;
  private now: Look | undefined;
  private arrived = 0;
  private interval = 100; // ms between looks, lately
  private view: View = "orbit";
  private frame = 0;
  private isDirty = true;
  private placed: PlacedCar[] | undefined;
  private readonly trails = new three.Group();

  constructor(
    private readonly canvas: HTMLCanvasElement,
    track: TrackGeometry,
    private readonly isCalm: boolean,
  ) {
    this.renderer = new three.WebGLRenderer({ canvas, antialias: true, powerPreference: "high-performance" });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.camera.up.set(0, 0, 1);
    const box = new three.Box2().setFromPoints([...track.outer, ...track.inner].map(([x, y]) => new three.Vector2(x, y)));
    const [center, extent] = [box.getCenter(new three.Vector2()), box.getSize(new three.Vector2())];
    this.middle.set(center.x, center.y, 0);
    this.size = Math.max(extent.x, extent.y * 1.5);

    this.scene.add(new three.HemisphereLight(0xffffff, 0x8f978f, 2.1));
    const sun = new three.DirectionalLight(0xfff2dd, 1.9);
    sun.position.set(3, -4, 9);
    this.scene.add(sun);
    this.field = new three.MeshLambertMaterial({ color: 0x7f9a78 });
    const ground = new three.Mesh(new three.PlaneGeometry(extent.x + 60, extent.y + 60), this.field);
    ground.position.copy(this.middle);
    this.scene.add(ground);
    const { inner, outer, is_closed: isClosed } = track;
    const flat = (color: number) => new three.MeshLambertMaterial({ color, side: three.DoubleSide });
    this.scene.add(new three.Mesh(band(inner, outer, isClosed, RISE), flat(0x3b4350)));
    this.scene.add(new three.Mesh(band(inner, inward(inner, outer, LINE), isClosed, 2 * RISE), flat(0xf4f4ef)));
    this.scene.add(new three.Mesh(band(outer, inward(outer, inner, LINE), isClosed, 2 * RISE), flat(0xf4f4ef)));
    this.scene.add(new three.Mesh(dashes(track.center, isClosed), flat(0xffb02e)));

    this.cars = new three.InstancedMesh(carGeometry(), new three.MeshLambertMaterial({ vertexColors: true }), MAX_CARS);
    this.cars.count = 0;
    this.cars.frustumCulled = false;
    this.scene.add(this.cars);

    this.scene.add(this.trails);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.maxPolarAngle = 1.5;
    this.controls.addEventListener("change", () => (this.isDirty = true));
    this.reset();
    this.watcher = new ResizeObserver(() => this.resize());
    this.watcher.observe(canvas);
    this.resize();
    this.frame = requestAnimationFrame(this.draw);
  }

  /** The newest moment. */
  show(look: Look): void {
    const time = performance.now();
    if (this.now) this.interval += 0.2 * (Math.min(time - this.arrived, 1000) - this.interval);
    [this.before, this.now, this.arrived] = [this.now, look, time];
    this.isDirty = true;
  }

  /** Put cars somewhere at once; the camera follows the first one. */
  put(cars: PlacedCar[]): void {
    this.placed = cars;
    this.isDirty = true;
  }

  /** Draw lines on the ground, instead of those before. */
  drawTrails(trails: Trail[]): void {
    this.clearTrails();
    for (const { points, colors } of trails) {
      const geometry = new three.BufferGeometry();
      geometry.setAttribute("position", new three.Float32BufferAttribute(points.flatMap(([x, y]) => [x!, y!, 4 * RISE]), 3));
      const tints = colors.flatMap((css) => new three.Color(css).toArray() as number[]);
      geometry.setAttribute("color", new three.Float32BufferAttribute(tints, 3));
      this.trails.add(new three.Line(geometry, new three.LineBasicMaterial({ vertexColors: true })));
    }
    this.isDirty = true;
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
    this.reset();
  }

  paint(isDark: boolean): void {
    const sky = isDark ? 0x11161c : 0xdfe6ea;
    this.scene.background = new three.Color(sky);
    this.scene.fog = new three.Fog(sky, this.size * 1.6, this.size * 5);
    this.field.color.set(isDark ? 0x4d6350 : 0x86a37e);
    this.isDirty = true;
  }

  close(): void {
    cancelAnimationFrame(this.frame);
    this.watcher.disconnect();
    this.controls.dispose();
    this.clearTrails();
    this.scene.traverse((thing) => {
      if (thing instanceof three.Mesh) {
        thing.geometry.dispose();
        (thing.material as three.Material).dispose();
      }
    });
    this.renderer.dispose();
  }

  private reset(): void {
    const { x, y } = this.middle;
    this.controls.target.copy(this.middle);
    if (this.view === "top") this.camera.position.set(x, y - 0.001, this.size * 1.12);
    else this.camera.position.set(x, y - this.size * 0.72, this.size * 0.62);
    this.camera.lookAt(this.middle);
    this.isDirty = true;
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.fov = Math.min(70, 42 * Math.max(1, 1.45 / this.camera.aspect));
    this.camera.updateProjectionMatrix();
    this.isDirty = true;
  }

  private readonly draw = (time: number): void => {
    this.frame = requestAnimationFrame(this.draw);
    const share = this.isCalm ? 1 : Math.min((time - this.arrived) / this.interval, 1);
    const isMoving = this.now !== undefined && time - this.arrived < this.interval + 50;
    if (!isMoving && !this.isDirty) return;
    this.isDirty = false;
    if (this.placed) this.placeCars(this.placed);
    else if (this.now) this.place(between(this.before, this.now, share));
    this.renderer.render(this.scene, this.camera);
  };

  private place(poses: ReturnType<typeof between>): void {
    this.cars.count = Math.min(poses.length, MAX_CARS);
    const colour = new three.Color();
    let leader = 0;
    poses.slice(0, MAX_CARS).forEach((pose, car) => {
      if (pose.progress > poses[leader]!.progress) leader = car;
      this.matrix.makeRotationZ(pose.heading).setPosition(pose.x, pose.y, 2 * RISE);
      this.cars.setMatrixAt(car, this.matrix);
      const tint = this.now?.tints?.[car];
      this.cars.setColorAt(car, tint !== undefined ? colour.setHex(tint) : colour.setHSL(0.58 - 0.5 * Math.min(Math.max(pose.progress, 0), 1), 0.75, 0.55));
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
      if (away > 0.02) this.isDirty = true; // until it has arrived, also where the car stands
    }
  }
}
