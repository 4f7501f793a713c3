// Which screen is shown, and of which job: kept in the address, so that a reload stays.
import { signal } from "@preact/signals";
import { words } from "./words.ts";

export type Screen = keyof typeof words.screens;
export const SCREENS = Object.keys(words.screens) as Screen[];

interface Place {
  screen: Screen;
  job: string;
}

function read(): Place {
  const [screen, job] = location.hash.slice(1).split("/");
  return {
    screen: SCREENS.find((one) => one === screen) ?? "station",
    job: decodeURIComponent(job ?? ""),
  };
}

export const place = signal<Place>({ screen: "station", job: "" });

export function go(screen: Screen, job = ""): void {
  location.hash = job ? `${screen}/${encodeURIComponent(job)}` : screen;
}

export function watchAddress(): void {
  place.value = read();
  addEventListener("hashchange", () => {
    place.value = read();
  });
}
