// What a scan shows so far: coarse meshes that come view by view; at the flip, turned over as the object is to be.
import type { Size } from "./stage.ts";

export type ToWorker =
  | { kind: "open"; canvas: OffscreenCanvas; size: Size }
  | { kind: "size"; size: Size }
  | { kind: "show"; meshes: [name: string, url: string][] }
  | { kind: "turn over"; on: boolean; again: boolean }
  | { kind: "drag"; x: number; y: number };

export interface ToPage {
  shown: string[];
}

export interface LiveView {
  /** Shows exactly these meshes; those that are there already are not loaded again. */
  show(names: readonly string[]): void;
  /** Turns the model over, again and again; at once and once where motion is not wanted. */
  turnOver(on: boolean): void;
  close(): void;
}

/** The canvas's data-shown names the meshes that it shows. Once opened, a canvas belongs to this view. */
export function openLive(canvas: HTMLCanvasElement, urlOf: (name: string) => string): LiveView {
  const script = document.querySelector<HTMLMetaElement>("meta[name=live-worker]")?.content ?? "";
  const worker = new Worker(script, { type: "module" });
  const say = (message: ToWorker, transfer: Transferable[] = []) => worker.postMessage(message, transfer);
  const size = () => ({ width: canvas.clientWidth, height: canvas.clientHeight, ratio: devicePixelRatio });
  worker.addEventListener("message", ({ data }: MessageEvent<ToPage>) => {
    canvas.dataset.shown = data.shown.join();
  });
  const offscreen = canvas.transferControlToOffscreen();
  say({ kind: "open", canvas: offscreen, size: size() }, [offscreen]);
  const resized = new ResizeObserver(() => say({ kind: "size", size: size() }));
  resized.observe(canvas);
  const onMove = (event: PointerEvent) => {
    if (event.buttons) say({ kind: "drag", x: event.movementX, y: event.movementY });
  };
  canvas.addEventListener("pointermove", onMove);
  return {
    show: (names) => say({ kind: "show", meshes: names.map((name) => [name, urlOf(name)]) }),
    turnOver: (on) =>
      say({ kind: "turn over", on, again: on && !matchMedia("(prefers-reduced-motion: reduce)").matches }),
    close() {
      resized.disconnect();
      canvas.removeEventListener("pointermove", onMove);
      worker.terminate();
    },
  };
}
