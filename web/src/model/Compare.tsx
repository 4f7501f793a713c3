// The model against a reference: which one, the scale of the colours, what came out.
import { type Signal, useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { fileOf, read } from "../api/client.ts";
import type { Deviation, Reference } from "../api/types.ts";
import type { Viewer } from "../view3d/viewer.ts";
import { words } from "../words.ts";
import { TOPS_MM, topFor } from "./scale.ts";

const UM_PER_MM = 1000;

async function fetchValues(job: string, file: string): Promise<Int16Array> {
  const response = await fetch(fileOf(job, file));
  if (!response.ok) throw new Error(`${response.status} ${response.statusText}`);
  return new Int16Array(await response.arrayBuffer());
}

interface Compared {
  figures: Deviation;
  um: Int16Array;
}

export function Compare({
  job,
  file,
  viewer,
  onShown,
}: {
  job: string;
  file: string;
  viewer: { current: Viewer | null };
  onShown: (shown: boolean) => void;
}) {
  const references = useSignal<Reference[]>([]);
  const chosen = useSignal("");
  const told = useSignal("");
  const top: Signal<number> = useSignal(1);
  const compared = useSignal<Compared | null>(null);

  useEffect(() => {
    read<{ references: Reference[] }>("/references").then(
      (got) => {
        references.value = got.references;
      },
      () => {},
    );
  }, []);

  const show = (mm: number) => {
    top.value = mm;
    const fits = compared.value && viewer.current?.compare(compared.value.um, UM_PER_MM * mm);
    if (!fits) compared.value = null;
    told.value = fits ? "" : words.otherFile;
    onShown(Boolean(fits));
  };
  const choose = async (name: string) => {
    chosen.value = name;
    compared.value = null;
    onShown(false);
    told.value = name ? words.comparing : "";
    if (!name) return;
    try {
      const path = `/jobs/${encodeURIComponent(job)}/deviation?reference=${encodeURIComponent(name)}`;
      const figures = await read<Deviation>(path);
      if (figures.model_file !== file) throw new Error(words.otherFile);
      const um = await fetchValues(job, figures.values_file);
      if (chosen.value !== name) return; // another one was chosen meanwhile
      compared.value = { figures, um };
      show(topFor(figures.p95_mm));
    } catch (error) {
      if (chosen.value === name) told.value = (error as Error).message;
    }
  };

  if (references.value.length === 0) return null;
  return (
    <div class="stack">
      <div class="row">
        <label class="row">
          {words.reference}
          <select value={chosen.value} onChange={(event) => choose(event.currentTarget.value)}>
            <option value="">{words.noReference}</option>
            {references.value.map((one) => (
              <option key={one.name} value={one.name}>
                {one.name}
              </option>
            ))}
          </select>
        </label>
        {compared.value && (
          <label class="row">
            {words.deviationTop}
            <select value={top.value} onChange={(event) => show(Number(event.currentTarget.value))}>
              {TOPS_MM.map((mm) => (
                <option key={mm} value={mm}>
                  ± {words.mm(mm)}
                </option>
              ))}
            </select>
          </label>
        )}
      </div>
      {compared.value && (
        <>
          <p class="row">
            −{words.mm(top.value)} <span class="scale deviation" aria-hidden="true" /> +{words.mm(top.value)}
          </p>
          <p class="dim">{words.deviationFigures(compared.value.figures)}</p>
        </>
      )}
      {told.value && <p role="status">{told.value}</p>}
    </div>
  );
}
