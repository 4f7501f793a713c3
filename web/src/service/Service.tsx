import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { order, read } from "../api/client.ts";
import { connect, health, login, status } from "../api/store.ts";
import type { ConfigCheck, Doctor, Health, Io } from "../api/types.ts";
import { may, Order } from "../parts/Order.tsx";
import { bytes, minutesSince, words } from "../words.ts";
import { FocusCard } from "./Focus.tsx";
import { LogCard } from "./Log.tsx";
import { qrSvg } from "./qr.ts";
import { SetupCard } from "./Setup.tsx";

const PERIOD_MS = 1000;
const HEALTH_PERIOD_MS = 5000;
const DOCTOR_PERIOD_MS = 60000;

function usePolled<T>(path: string, period_ms: number, first: T | null = null) {
  const value = useSignal<T | null>(first);
  useEffect(() => {
    const ask = () =>
      read<T>(path, AbortSignal.timeout(5000)).then(
        (got) => {
          value.value = got;
        },
        () => {},
      );
    ask();
    const timer = setInterval(ask, period_ms);
    return () => clearInterval(timer);
  }, [path]);
  return value;
}

function HealthCard() {
  const now = usePolled<Health>("/health", HEALTH_PERIOD_MS, health.value).value;
  if (!now) return null;
  return (
    <section class="card">
      <h2>{words.health}</h2>
      {now.problems.length === 0 && <p>{words.allWell}</p>}
      {now.problems.map((problem) => (
        <p key={problem.message} class="wrong">
          {problem.message}
        </p>
      ))}
      {now.reminders.map((reminder) => (
        <p key={reminder}>{reminder}</p>
      ))}
      <p class="dim">
        {words.disk(bytes(now.disk.free_bytes), bytes(now.disk.bytes))} ·{" "}
        {words.uptime((now.uptime_s / 3600).toFixed(1))} · {words.version} {now.version}
      </p>
      {now.temperatures.map((one) => (
        <p key={one.sensor} class="dim">
          {one.sensor} {one.celsius.toFixed(0)} °C
        </p>
      ))}
    </section>
  );
}

/// What `scanrig doctor` found while the service was stopped.
function DoctorCard() {
  const report = usePolled<Doctor>("/doctor", DOCTOR_PERIOD_MS).value;
  if (!report) return null;
  const { time, findings } = report;
  const age = time === null ? "" : words.ago(minutesSince(time));
  return (
    <section class="card">
      <h2>{words.doctor}</h2>
      {time === null && <p>{words.doctorNever}</p>}
      {time !== null && (
        <p>{findings.length === 0 ? words.doctorWell(age) : words.doctorFound(age, findings.length)}</p>
      )}
      {findings.map((one) => (
        <div key={one.id + one.problem}>
          <p class="wrong">{one.problem}</p>
          <p>{one.remedy}</p>
        </div>
      ))}
      <p class="dim">{words.doctorHow}</p>
    </section>
  );
}

const JOGS = [-90, -10, 10, 90];

function TableCard() {
  const active = status.value?.machine.includes("Maintenance") ?? false;
  const maintenance = (what: string, body = {}) => order(`/maintenance/${what}`, body);
  return (
    <section class="card">
      <h2>{words.table}</h2>
      {!may("engineer") && <p class="dim">{words.needs("engineer")}</p>}
      <div class="row">
        <Order needs="engineer" send={() => maintenance(active ? "off" : "on")}>
          {active ? words.maintenanceOff : words.maintenanceOn}
        </Order>
        {active && (
          <>
            <Order needs="engineer" send={() => maintenance("home")}>
              {words.home}
            </Order>
            {JOGS.map((by) => (
              <Order key={by} needs="engineer" send={() => maintenance("jog", { by_deg: by })}>
                {words.jog(by)}
              </Order>
            ))}
            <Order needs="engineer" send={() => maintenance("pulse")}>
              {words.flash}
            </Order>
            <Order needs="engineer" send={() => maintenance("lamp_test")}>
              {words.lampTest}
            </Order>
          </>
        )}
      </div>
    </section>
  );
}

function Contacts({ title, values }: { title: string; values: Record<string, boolean> }) {
  return (
    <div>
      <h3>{title}</h3>
      <dl class="facts">
        {Object.entries(values).map(([name, on]) => (
          <>
            <dt>{name}</dt>
            <dd>{on ? `● ${words.on}` : `○ ${words.off}`}</dd>
          </>
        ))}
      </dl>
    </div>
  );
}

function IoCard() {
  const io = usePolled<Io>("/io", PERIOD_MS).value;
  if (!io) return null;
  return (
    <section class="card">
      <Contacts title={words.inputs} values={io.inputs} />
      <Contacts title={words.outputs} values={io.outputs} />
    </section>
  );
}

function AccessCard() {
  const code = useSignal("");
  const picture = useSignal("");
  const who = login.value;
  const offer = async () => {
    const made = await order<{ code: string; valid_s: number }>("/login/code");
    code.value = made.code;
    picture.value = await qrSvg(`${location.origin}/#code=${made.code}`);
    setTimeout(() => {
      code.value = "";
      picture.value = "";
    }, made.valid_s * 1000);
  };
  return (
    <section class="card">
      <h2>{words.access}</h2>
      <p>{who && words.you(who.role, who.name)}</p>
      <div class="row">
        <Order needs="viewer" send={offer}>
          {words.offerCode}
        </Order>
        {who?.cookie && (
          <Order needs="viewer" send={() => order("/login", {}, "DELETE").then(connect)}>
            {words.logOut}
          </Order>
        )}
      </div>
      {code.value && (
        <div class="row">
          {picture.value && <img class="qr" src={picture.value} alt={code.value} />}
          <div>
            <p class="code">{code.value}</p>
            <p class="dim">{words.codeValid(120)}</p>
          </div>
        </div>
      )}
    </section>
  );
}

/// rig.toml as a person has left it.
function ConfigCard() {
  const told = useSignal<string[]>([]);
  if (!may("engineer")) return null;
  const check = async () => {
    const { problems } = await order<ConfigCheck>("/config/check");
    told.value = problems.length === 0 ? [words.configValid] : problems;
  };
  return (
    <section class="card">
      <h2>{words.config}</h2>
      <p class="dim">{words.configHow}</p>
      <div class="row">
        <Order needs="engineer" send={check}>
          {words.configCheck}
        </Order>
        <Order needs="engineer" hold send={() => order("/reload")}>
          {words.hold(words.configReload)}
        </Order>
      </div>
      {told.value.map((sentence) => (
        <p key={sentence} role="status">
          {sentence}
        </p>
      ))}
    </section>
  );
}

export function Service() {
  return (
    <main class="columns">
      <div class="stack">
        <HealthCard />
        <DoctorCard />
        <TableCard />
        <SetupCard />
        <FocusCard />
        <LogCard />
      </div>
      <div class="stack">
        <IoCard />
        <AccessCard />
        <ConfigCard />
      </div>
    </main>
  );
}
