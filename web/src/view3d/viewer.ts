// The model in three.js, drawn only when something has changed.
import {
  AmbientLight,
  Box3,
  BufferGeometry,
  Color,
  DirectionalLight,
  Line,
  LineBasicMaterial,
  type Material,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  PerspectiveCamera,
  Plane,
  Raycaster,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

export interface Viewer {
  colour(how: "texture" | "shade"): void;
  /** Cuts away this share of the height, from the top. */
  cut(share: number): void;
  measure(on: boolean): void;
  close(): void;
}

const MM_PER_M = 1000; // GLB is in metres
const CLICK_PX = 5; // a pointer that moved further has turned the view

interface Stage {
  scene: Scene;
  camera: PerspectiveCamera;
  renderer: WebGLRenderer;
  controls: OrbitControls;
  draw: () => void;
}

function stage(canvas: HTMLCanvasElement, box: Box3): Stage {
  const renderer = new WebGLRenderer({ canvas, antialias: true });
  renderer.localClippingEnabled = true;
  renderer.setClearColor(new Color("#12171c"));
  const scene = new Scene();
  const centre = box.getCenter(new Vector3());
  const size = box.getSize(new Vector3()).length();
  const camera = new PerspectiveCamera(35, 1, size / 100, size * 20);
  camera.position.copy(centre).add(new Vector3(0.4, 0.35, 1).normalize().multiplyScalar(size * 1.7));
  const light = new DirectionalLight("#ffffff", 2.2);
  light.position.set(1, 2, 3);
  camera.add(light);
  scene.add(camera, new AmbientLight("#ffffff", 1));
  const controls = new OrbitControls(camera, canvas);
  controls.target.copy(centre);
  let due = false;
  const draw = () => {
    if (due) return;
    due = true;
    requestAnimationFrame(() => {
      due = false;
      const { clientWidth: width, clientHeight: height } = canvas;
      renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
      renderer.setSize(width, height, false);
      camera.aspect = width / Math.max(height, 1);
      camera.updateProjectionMatrix();
      renderer.render(scene, camera);
    });
  };
  controls.addEventListener("change", draw);
  controls.update();
  return { scene, camera, renderer, controls, draw };
}

/** Two taps on the surface give a distance; a third begins again. */
class Ruler {
  on = false;
  private points: Vector3[] = [];
  private line: Line | null = null;

  constructor(
    private readonly at: Stage,
    private readonly meshes: Mesh[],
    private readonly tell: (mm: number | null) => void,
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
    this.tell(from.distanceTo(to) * MM_PER_M);
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

function materials(mesh: Mesh, plane: Plane): Record<"texture" | "shade", Material> {
  const own = mesh.material as MeshStandardMaterial;
  const clippingPlanes = [plane];
  return {
    texture: new MeshBasicMaterial({
      ...(own.map ? { map: own.map } : { color: "#cccccc" }),
      vertexColors: !own.map && mesh.geometry.hasAttribute("color"),
      clippingPlanes,
      side: 2,
    }),
    shade: new MeshStandardMaterial({ color: "#b9c3cc", roughness: 0.75, clippingPlanes, side: 2 }),
  };
}

/** `measured` gets each distance in mm, or null after the first of two points. */
export async function openViewer(
  canvas: HTMLCanvasElement,
  url: string,
  measured: (mm: number | null) => void,
): Promise<Viewer> {
  const { scene: loaded } = await new GLTFLoader().loadAsync(url);
  const box = new Box3().setFromObject(loaded);
  const at = stage(canvas, box);
  const plane = new Plane(new Vector3(0, -1, 0), box.max.y);
  const meshes: Mesh[] = [];
  loaded.traverse((one) => {
    if (one instanceof Mesh) meshes.push(one);
  });
  const looks = new Map(meshes.map((mesh) => [mesh, materials(mesh, plane)]));
  for (const mesh of meshes) {
    if (!mesh.geometry.hasAttribute("normal")) mesh.geometry.computeVertexNormals();
  }
  at.scene.add(loaded);
  const ruler = new Ruler(at, meshes, measured);
  const colour = (how: "texture" | "shade") => {
    for (const mesh of meshes) mesh.material = looks.get(mesh)?.[how] ?? mesh.material;
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
  const resized = new ResizeObserver(at.draw);
  resized.observe(canvas);
  colour("texture");
  return {
    colour,
    cut(share) {
      plane.constant = box.max.y - share * (box.max.y - box.min.y) + (share === 0 ? 1 : 0);
      at.draw();
    },
    measure(on) {
      ruler.on = on;
      if (!on) ruler.clear();
    },
    close() {
      resized.disconnect();
      canvas.removeEventListener("pointerdown", onDown);
      canvas.removeEventListener("pointerup", onUp);
      at.controls.dispose();
      at.renderer.dispose();
    },
  };
}
