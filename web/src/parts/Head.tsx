// The word that is read from two metres, the daemon's sentence and next action, and STOP.
import { activeJob, insecure, isOld, silentFor_s, status } from "../api/store.ts";
import type { Tone } from "../api/types.ts";
import { words } from "../words.ts";
import { Ring } from "./Ring.tsx";
import { Stop } from "./Stop.tsx";

/** A person has to act: then the cause is told, too. */
const WITH_CAUSE: Tone[] = ["act", "fault"];

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
        {now && WITH_CAUSE.includes(now.tone) && <p class="cause">{now.cause}</p>}
        <p class="next">{now?.next_action ?? ""}</p>
      </div>
      <Stop />
    </header>
  );
}
