// A scene on a canvas with its light and a camera that turns around it; drawn only when something has changed.
import {
  AmbientLight,
  type Box3,
  Color,
  DirectionalLight,
  PerspectiveCamera,
  Scene,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

export interface Stage {
  scene: Scene;
  camera: PerspectiveCamera;
  draw(): void;
  /** Puts the camera so that the box is seen whole. */
  frame(box: Box3): void;
  close(): void;
}

const DISTANCE = 1.7; // in diagonals of the box
const FROM = new Vector3(0.4, 0.35, 1).normalize();

export function openStage(canvas: HTMLCanvasElement): Stage {
  const renderer = new WebGLRenderer({ canvas, antialias: true });
  renderer.localClippingEnabled = true;
  renderer.setClearColor(new Color("#12171c"));
  const scene = new Scene();
  const camera = new PerspectiveCamera(35, 1);
  const light = new DirectionalLight("#ffffff", 2.2);
  light.position.set(1, 2, 3);
  camera.add(light);
  scene.add(camera, new AmbientLight("#ffffff", 1));
  const controls = new OrbitControls(camera, canvas);
  let due = false;
  let closed = false;
  const draw = () => {
    if (due || closed) return;
    due = true;
    requestAnimationFrame(() => {
      due = false;
      if (closed) return;
      const { clientWidth: width, clientHeight: height } = canvas;
      renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
      renderer.setSize(width, height, false);
      camera.aspect = width / Math.max(height, 1);
      camera.updateProjectionMatrix();
      renderer.render(scene, camera);
    });
  };
  controls.addEventListener("change", draw);
  const resized = new ResizeObserver(draw);
  resized.observe(canvas);
  return {
    scene,
    camera,
    draw,
    frame(box) {
      const centre = box.getCenter(new Vector3());
      const size = box.getSize(new Vector3()).length();
      camera.near = size / 100;
      camera.far = size * 20;
      camera.position.copy(centre).addScaledVector(FROM, size * DISTANCE);
      controls.target.copy(centre);
      controls.update();
      draw();
    },
    close() {
      closed = true;
      resized.disconnect();
      controls.dispose();
      renderer.dispose();
    },
  };
}
