// What a scan shows so far: coarse meshes that come view by view; at the flip, turned over as the object is to be.
import { Box3, Group, Mesh, MeshBasicMaterial, type Object3D, Vector3 } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { openStage } from "./stage.ts";

export interface LiveView {
  /** Shows exactly these meshes; those that are there already are not loaded again. */
  show(names: readonly string[]): void;
  /** Turns the model over, again and again; at once and once where motion is not wanted. */
  turnOver(on: boolean): void;
  close(): void;
}

const TURN_MS = 2500;
const HOLD_MS = 1500;

function dispose(object: Object3D) {
  object.traverse((one) => {
    if (!(one instanceof Mesh)) return;
    one.geometry.dispose();
    one.material.dispose();
  });
}

/** The canvas's data-shown names the meshes that it shows. */
export function openLive(canvas: HTMLCanvasElement, urlOf: (name: string) => string): LiveView {
  const at = openStage(canvas);
  const turned = new Group(); // about the centre of what is shown
  const content = new Group();
  turned.add(content);
  at.scene.add(turned);
  const loader = new GLTFLoader();
  const loaded = new Map<string, Object3D | null>(); // null: on its way
  let wanted = new Set<string>();
  let closed = false;
  let isTurning = false;

  const arrange = () => {
    turned.position.set(0, 0, 0);
    content.position.set(0, 0, 0);
    const rotation = turned.rotation.x;
    turned.rotation.x = 0;
    turned.updateMatrixWorld(true);
    const box = new Box3().setFromObject(content);
    if (!box.isEmpty()) {
      const centre = box.getCenter(new Vector3());
      turned.position.copy(centre);
      content.position.copy(centre).negate();
      at.frame(box);
    }
    turned.rotation.x = rotation;
    canvas.dataset.shown = [...loaded].flatMap(([name, mesh]) => (mesh ? [name] : [])).join();
    at.draw();
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
    const { scene } = await loader.loadAsync(urlOf(name));
    if (closed || !wanted.has(name)) return dispose(scene);
    scene.traverse((one) => {
      if (one instanceof Mesh) one.material = new MeshBasicMaterial({ vertexColors: true, side: 2 });
    });
    loaded.set(name, scene);
    content.add(scene);
    // What it replaces stays until it is there.
    for (const other of [...loaded.keys()]) if (!wanted.has(other)) remove(other);
    arrange();
  };
  const turn = (begun: number) => {
    if (closed || !isTurning) return;
    const share = ((performance.now() - begun) % (TURN_MS + HOLD_MS)) / TURN_MS;
    turned.rotation.x = Math.PI * (1 - Math.cos(Math.PI * Math.min(share, 1))) * 0.5;
    at.draw();
    requestAnimationFrame(() => turn(begun));
  };
  return {
    show(names) {
      wanted = new Set(names);
      for (const name of names) {
        // One that is gone again, for the scan has ended, is not needed.
        if (!loaded.has(name)) load(name).catch(() => loaded.delete(name));
      }
      if (names.length > 0) return;
      for (const name of [...loaded.keys()]) remove(name);
      at.draw();
    },
    turnOver(on) {
      isTurning = on && !matchMedia("(prefers-reduced-motion: reduce)").matches;
      turned.rotation.x = on ? Math.PI : 0;
      at.draw();
      if (isTurning) turn(performance.now());
    },
    close() {
      closed = true;
      for (const name of [...loaded.keys()]) remove(name);
      at.close();
    },
  };
}
