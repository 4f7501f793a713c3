// Keys: 1 to 5 for the screens, X for Stop. None starts a motion.
import { order } from "./api/client.ts";
import { go, SCREENS } from "./screens.ts";

export function onKey(event: KeyboardEvent): void {
  const typing = event.target instanceof HTMLInputElement || event.target instanceof HTMLSelectElement;
  if (typing || event.ctrlKey || event.altKey || event.metaKey || event.repeat) return;
  const screen = SCREENS[Number(event.key) - 1];
  if (screen) go(screen);
  if (event.key.toLowerCase() === "x") order("/stop").catch(() => {});
}
