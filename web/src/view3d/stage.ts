// A scene on a canvas with its light and camera, in a page or in a worker; drawn only when something has changed.
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

export interface Size {
  width: number; // CSS pixels
  height: number;
  ratio: number;
}

export interface Stage {
  scene: Scene;
  camera: PerspectiveCamera;
  /** Soon, once, whatever the number of calls. */
  draw(): void;
  /** Puts the camera so that the box is seen whole; returns its centre. */
  frame(box: Box3): Vector3;
  close(): void;
}

const DISTANCE = 1.7; // in diagonals of the box
const FROM = new Vector3(0.4, 0.35, 1).normalize();

export function openStage(canvas: HTMLCanvasElement | OffscreenCanvas, sizeOf: () => Size): Stage {
  const renderer = new WebGLRenderer({ canvas, antialias: true });
  renderer.localClippingEnabled = true;
  renderer.setClearColor(new Color("#12171c"));
  const scene = new Scene();
  const camera = new PerspectiveCamera(35, 1);
  const light = new DirectionalLight("#ffffff", 2.2);
  light.position.set(1, 2, 3);
  camera.add(light);
  scene.add(camera, new AmbientLight("#ffffff", 1));
  let due = false;
  let closed = false;
  const draw = () => {
    if (due || closed) return;
    due = true;
    requestAnimationFrame(() => {
      due = false;
      if (closed) return;
      const { width, height, ratio } = sizeOf();
      renderer.setPixelRatio(Math.min(ratio, 2));
      renderer.setSize(width, height, false);
      camera.aspect = width / Math.max(height, 1);
      camera.updateProjectionMatrix();
      renderer.render(scene, camera);
    });
  };
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
      camera.lookAt(centre);
      draw();
      return centre;
    },
    close() {
      closed = true;
      renderer.dispose();
    },
  };
}
