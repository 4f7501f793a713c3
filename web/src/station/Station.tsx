import { order } from "../api/client.ts";
import { activeJob, jobs, status } from "../api/store.ts";
import { JobLine } from "../jobs/JobLine.tsx";
import { may, Order } from "../parts/Order.tsx";
import { words } from "../words.ts";
import { Live } from "./Live.tsx";
import { Picture } from "./Picture.tsx";
import { Suggestions } from "./Suggestions.tsx";

function Buttons() {
  const now = status.value;
  if (!now) return null;
  const { start, reset } = now.actions;
  return (
    <>
      <div class="start-place">
        <Order needs="operator" class="start" action={start} send={() => order("/start", { offer: start.offer })}>
          {words.start}
        </Order>
      </div>
      {start.ok && may("operator") && <p class="dim">{words.startDoes[start.does]}</p>}
      {(reset.ok || !start.ok) && now.tone !== "working" && (
        <Order needs="operator" class="big" action={reset} send={() => order("/reset")}>
          {words.reset}
        </Order>
      )}
    </>
  );
}

function Devices() {
  return (
    <section class="card">
      <h2>{words.devices}</h2>
      <ul>
        {status.value?.devices.map((device) => (
          <li key={device.name} class={device.ok ? "" : "wrong"}>
            {device.ok ? "✓" : "✗"} {device.name}
            {device.problem && `: ${device.problem.message}`}
          </li>
        ))}
      </ul>
    </section>
  );
}

export function Station() {
  const now = status.value;
  const active = activeJob.value;
  const next = now?.queue[0] ? jobs.value.get(now.queue[0]) : undefined;
  return (
    <main class="columns">
      <div class="stack">
        {active?.state === "waiting_for_flip" && active.suggestions.length > 0 && <Suggestions job={active} />}
        {active && active.live.length > 0 && <Live key={active.id} job={active} />}
        <div class="pictures">
          <Picture side="left" />
          <Picture side="right" />
        </div>
        {active && <JobLine job={active} />}
      </div>
      <div class="stack">
        <Buttons />
        {now?.not_started && (
          <p class="card wrong" role="alert">
            {now.not_started.why.message}
          </p>
        )}
        {!active && (
          <section class="card">
            <h2>{words.nextJob}</h2>
            {next ? <JobLine job={next} /> : <p class="dim">{words.noJob}</p>}
          </section>
        )}
        <Devices />
      </div>
    </main>
  );
}
