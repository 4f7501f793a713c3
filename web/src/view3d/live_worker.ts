// Draws what a scan shows so far, beside the page's own thread: loading and drawing never delay a button.
import { Box3, Group, Mesh, MeshBasicMaterial, type Object3D, Quaternion, Vector3 } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import type { ToPage, ToWorker } from "./live.ts";
import { openStage, type Size } from "./stage.ts";

const TURN_MS = 2500;
const HOLD_MS = 1500;
const TURN_PER_PX = 0.01;
const UP = new Vector3(0, 1, 0);
const RIGHT = new Vector3(1, 0, 0);

function dispose(object: Object3D) {
  object.traverse((one) => {
    if (!(one instanceof Mesh)) return;
    one.geometry.dispose();
    one.material.dispose();
  });
}

/** `tell` gets the names of the meshes that are shown, whenever they change. */
function openLive(canvas: OffscreenCanvas, size: Size, tell: (shown: string[]) => void) {
  const at = openStage(canvas, () => size);
  const turned = new Group(); // about the centre of what is shown
  const content = new Group();
  turned.add(content);
  at.scene.add(turned);
  const loader = new GLTFLoader();
  const loaded = new Map<string, Object3D | null>(); // null: on its way
  let urls = new Map<string, string>(); // of what is to be shown, by name
  let isTurning = false;
  const asItLies = new Quaternion();
  const turnedOver = new Quaternion(1, 0, 0, 0); // half a turn, until a mesh says how it can lie

  const arrange = () => {
    turned.position.set(0, 0, 0);
    content.position.set(0, 0, 0);
    const rotation = turned.quaternion.clone();
    turned.quaternion.copy(asItLies);
    turned.updateMatrixWorld(true);
    const box = new Box3().setFromObject(content);
    if (!box.isEmpty()) {
      const centre = box.getCenter(new Vector3());
      turned.position.copy(centre);
      content.position.copy(centre).negate();
      at.frame(box);
    }
    turned.quaternion.copy(rotation);
    at.draw();
    tell([...loaded].flatMap(([name, mesh]) => (mesh ? [name] : [])));
  };
  const remove = (name: string) => {
    const old = loaded.get(name);
    loaded.delete(name);
    if (!old) return;
    content.remove(old);
    dispose(old);
  };
  const load = async (name: string) => {
    loaded.set(name, null);
    const { scene } = await loader.loadAsync(urls.get(name) ?? "");
    if (!urls.has(name)) return dispose(scene);
    scene.traverse((one) => {
      const { other_rest } = one.userData as { other_rest?: [number, number, number, number] };
      if (other_rest) turnedOver.set(...other_rest);
      if (one instanceof Mesh) one.material = new MeshBasicMaterial({ vertexColors: true, side: 2 });
    });
    loaded.set(name, scene);
    content.add(scene);
    // What it replaces stays until it is there.
    for (const other of [...loaded.keys()]) if (!urls.has(other)) remove(other);
    arrange();
  };
  const turn = (begun: number) => {
    if (!isTurning) return;
    const share = ((performance.now() - begun) % (TURN_MS + HOLD_MS)) / TURN_MS;
    turned.quaternion.slerpQuaternions(asItLies, turnedOver, (1 - Math.cos(Math.PI * Math.min(share, 1))) * 0.5);
    at.draw();
    requestAnimationFrame(() => turn(begun));
  };
  return (message: ToWorker) => {
    switch (message.kind) {
      case "size":
        size = message.size;
        return at.draw();
      case "show":
        urls = new Map(message.meshes);
        for (const name of urls.keys()) {
          // One that is gone again, for the scan has ended, is not needed.
          if (!loaded.has(name)) load(name).catch(() => loaded.delete(name));
        }
        if (urls.size > 0) return;
        for (const name of [...loaded.keys()]) remove(name);
        return at.draw();
      case "turn over":
        isTurning = message.again;
        turned.quaternion.copy(message.on ? turnedOver : asItLies);
        at.draw();
        if (isTurning) turn(performance.now());
        return;
      case "drag":
        turned.rotateOnWorldAxis(UP, TURN_PER_PX * message.x);
        if (!isTurning) turned.rotateOnWorldAxis(RIGHT, TURN_PER_PX * message.y);
        return at.draw();
      case "open":
        return;
      default: {
        const never: never = message;
        return never;
      }
    }
  };
}

let hear: ((message: ToWorker) => void) | null = null;
addEventListener("message", ({ data }: MessageEvent<ToWorker>) => {
  if (data.kind === "open") {
    hear = openLive(data.canvas, data.size, (shown) => postMessage({ shown } satisfies ToPage));
  } else {
    hear?.(data);
  }
});
