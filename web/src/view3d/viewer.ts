// The model in three.js, drawn only when something has changed.
import {
  Box3,
  BufferAttribute,
  BufferGeometry,
  Line,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  Plane,
  Raycaster,
  Vector2,
  Vector3,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { COLOURINGS, type Colouring, deviationLook, looksOf } from "./colourings.ts";
import { cutAt, type Surface } from "./outline.ts";
import { openStage, type Stage } from "./stage.ts";

/** In mm, the model's frame. */
export type Point = [number, number, number];

export interface Viewer {
  colourings: Colouring[]; // that the file has data for
  colour(how: Colouring): void;
  /** Colours by deviation, one value per vertex, from -top to top. False: these are of another model. */
  compare(um: Int16Array, top_um: number): boolean;
  /** Cuts away this share of the height, from the top. */
  cut(share: number): void;
  measure(on: boolean): void;
  close(): void;
}

const MM_PER_M = 1000; // GLB is in metres
const CLICK_PX = 5; // a pointer that moved further has turned the view

/** Two taps on the surface give a distance; a third begins again. */
class Ruler {
  on = false;
  private points: Vector3[] = [];
  private line: Line | null = null;

  constructor(
    private readonly at: Stage,
    private readonly meshes: Mesh[],
    private readonly tell: (ends: [Point, Point] | null) => void,
  ) {}

  tap(where: Vector2) {
    const ray = new Raycaster();
    ray.setFromCamera(where, this.at.camera);
    const hit = ray.intersectObjects(this.meshes, false)[0];
    if (!hit) return;
    if (this.points.length === 2) this.clear();
    this.points.push(hit.point);
    const [from, to] = this.points;
    if (!from || !to) return this.tell(null);
    const material = new LineBasicMaterial({ color: "#f2b134", depthTest: false });
    this.line = new Line(new BufferGeometry().setFromPoints([from, to]), material);
    this.at.scene.add(this.line);
    const inMm = (point: Vector3): Point => [point.x * MM_PER_M, point.y * MM_PER_M, point.z * MM_PER_M];
    this.tell([inMm(from), inMm(to)]);
    this.at.draw();
  }

  clear() {
    if (this.line) this.at.scene.remove(this.line);
    this.line?.geometry.dispose();
    this.line = null;
    this.points = [];
    this.at.draw();
  }
}

/** The mesh as the plane of the section sees it. */
function surfaceOf(mesh: Mesh): Surface {
  mesh.updateWorldMatrix(true, false);
  const position = mesh.geometry.getAttribute("position");
  const points = new Float32Array(3 * position.count);
  const point = new Vector3();
  for (let i = 0; i < position.count; i++) {
    point
      .fromBufferAttribute(position, i)
      .applyMatrix4(mesh.matrixWorld)
      .toArray(points, 3 * i);
  }
  return { points, corners: mesh.geometry.index?.array ?? Uint32Array.from({ length: position.count }, (_, i) => i) };
}

/** The line where a section's plane cuts the surface. */
class Outline {
  private readonly line = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: "#f2b134" }));
  private surfaces: Surface[] | null = null;

  constructor(
    at: Stage,
    private readonly meshes: Mesh[],
  ) {
    this.line.visible = false;
    at.scene.add(this.line);
  }

  show(height: number | null) {
    this.line.visible = height !== null;
    if (height === null) return;
    this.surfaces ??= this.meshes.map(surfaceOf);
    const cuts = this.surfaces.map((surface) => cutAt(surface, height));
    const all = new Float32Array(cuts.reduce((sum, cut) => sum + cut.length, 0));
    let from = 0;
    for (const cut of cuts) {
      all.set(cut, from);
      from += cut.length;
    }
    this.line.geometry.dispose();
    this.line.geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(all, 3));
  }
}

/** `measured` gets two points of the surface, or null after the first of them. */
export async function openViewer(
  canvas: HTMLCanvasElement,
  url: string,
  measured: (ends: [Point, Point] | null) => void,
): Promise<Viewer> {
  const { scene: loaded } = await new GLTFLoader().loadAsync(url);
  const box = new Box3().setFromObject(loaded);
  const at = openStage(canvas, () => ({
    width: canvas.clientWidth,
    height: canvas.clientHeight,
    ratio: devicePixelRatio,
  }));
  const controls = new OrbitControls(at.camera, canvas);
  controls.target.copy(at.frame(box));
  controls.addEventListener("change", at.draw);
  controls.update();
  const resized = new ResizeObserver(at.draw);
  resized.observe(canvas);
  const plane = new Plane(new Vector3(0, -1, 0), box.max.y);
  const meshes: Mesh[] = [];
  loaded.traverse((one) => {
    if (one instanceof Mesh) meshes.push(one);
  });
  for (const mesh of meshes) {
    if (!mesh.geometry.hasAttribute("normal")) mesh.geometry.computeVertexNormals();
  }
  const looks = meshes.map((mesh) => looksOf(mesh, plane));
  at.scene.add(loaded);
  const outline = new Outline(at, meshes);
  const ruler = new Ruler(at, meshes, measured);
  const colour = (how: Colouring) => {
    for (const look of looks) look[how]?.();
    at.draw();
  };
  const down = new Vector2();
  const onDown = (event: PointerEvent) => down.set(event.clientX, event.clientY);
  const onUp = (event: PointerEvent) => {
    if (!ruler.on || down.distanceTo(new Vector2(event.clientX, event.clientY)) > CLICK_PX) return;
    const frame = canvas.getBoundingClientRect();
    const x = ((event.clientX - frame.left) / frame.width) * 2 - 1;
    const y = 1 - ((event.clientY - frame.top) / frame.height) * 2;
    ruler.tap(new Vector2(x, y));
  };
  canvas.addEventListener("pointerdown", onDown);
  canvas.addEventListener("pointerup", onUp);
  colour("texture");
  return {
    colourings: COLOURINGS.filter((how) => looks.every((look) => look[how])),
    colour,
    compare(um, top_um) {
      const [mesh, look] = [meshes[0], looks[0]];
      if (!mesh || !look || meshes.length > 1 || mesh.geometry.getAttribute("position").count !== um.length)
        return false;
      look.deviation = deviationLook(mesh, plane, um, top_um);
      colour("deviation");
      return true;
    },
    cut(share) {
      const height = box.max.y - share * (box.max.y - box.min.y);
      plane.constant = height + (share === 0 ? 1 : 0);
      outline.show(share === 0 ? null : height);
      at.draw();
    },
    measure(on) {
      ruler.on = on;
      if (!on) ruler.clear();
    },
    close() {
      canvas.removeEventListener("pointerdown", onDown);
      canvas.removeEventListener("pointerup", onUp);
      resized.disconnect();
      controls.dispose();
      at.close();
    },
  };
}
