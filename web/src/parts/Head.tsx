// The word that is read from two metres, the daemon's sentence and next action, and STOP.
import { activeJob, insecure, isOld, silentFor_s, status } from "../api/store.ts";
import type { Status } from "../api/types.ts";
import { words } from "../words.ts";
import { Ring } from "./Ring.tsx";
import { Stop } from "./Stop.tsx";

/** Where the rig waits for Reset the sentence does not say what stopped it. */
const saysCause = (now: Status) => now.tone === "fault" || now.machine === "Halted";

export function Head() {
  const now = status.value;
  const job = activeJob.value;
  return (
    <header class={`head tone-${now?.tone ?? "idle"}`}>
      {isOld.value && (
        <p class="banner" role="alert">
          {now ? words.lost(silentFor_s.value) : words.waiting}
        </p>
      )}
      {insecure.value && <p class="banner">{words.insecure}</p>}
      <h1 class="word">
        <span class="tile">
          <span class={`shape shape-${now?.tone ?? "idle"}`} aria-hidden="true" />
          {now?.word ?? ""}
        </span>
        {job && <Ring job={job} />}
      </h1>
      <div class="saying" aria-live="polite">
        <p class="sentence">{now?.sentence ?? ""}</p>
        {now && saysCause(now) && <p class="cause">{now.cause}</p>}
        <p class="next">{now?.next_action ?? ""}</p>
        {now?.last_order && <p class="last-order dim">{words.lastOrder(now.last_order)}</p>}
      </div>
      <Stop />
    </header>
  );
}
