// One copy of what the daemon says. An event replaces a whole object; nothing here is decided by the page.
import { computed, signal } from "@preact/signals";
import { API, Refused, read } from "./client.ts";
import * as link from "./link.ts";
import type { Health, Job, Login, Snapshot, Status } from "./types.ts";

export const status = signal<Status | null>(null);
export const jobs = signal<ReadonlyMap<string, Job>>(new Map());
export const health = signal<Health | null>(null);
export const login = signal<Login | null>(null);
export const insecure = signal(false);
export const needsLogin = signal(false);
export const connection = signal(link.newLink(performance.now()));
export const now = signal(performance.now());

export const isOld = computed(() => link.isOld(connection.value, now.value));
export const isDeaf = computed(() => link.isDeaf(connection.value, now.value));
export const silentFor_s = computed(() => Math.max(0, Math.round((now.value - connection.value.heard) / 1000)));
export const activeJob = computed(() => {
  const id = status.value?.job;
  return id ? (jobs.value.get(id) ?? null) : null;
});
export const newestFirst = computed(() => [...jobs.value.values()].sort((a, b) => (a.id < b.id ? 1 : -1)));

const TICK_MS = 50;
const HIDDEN_MS = 10_000; // a hidden page asks so often, over no stream
const OPEN_LIMIT_MS = 5000;

let stream: EventSource | null = null;
let build = "";

function setStatus(next: Status) {
  const before = status.value?.actions.start.offer ?? "";
  now.value = performance.now();
  connection.value = link.noteChange(connection.value, before, next.actions.start.offer, now.value);
  status.value = next;
}

function take(snapshot: Snapshot) {
  if (build && build !== snapshot.build) location.reload(); // another version of the page is there
  build = snapshot.build;
  setStatus(snapshot.status);
  jobs.value = new Map(snapshot.jobs.map((job) => [job.id, job]));
  health.value = snapshot.health;
  login.value = snapshot.login;
  insecure.value = snapshot.insecure;
}

function hear() {
  connection.value = link.heard(connection.value, performance.now());
}

function listen(source: EventSource) {
  const on = <T>(name: string, then: (data: T) => void) =>
    source.addEventListener(name, (event) => {
      hear();
      then(JSON.parse((event as MessageEvent<string>).data));
    });
  on<Status>("status", setStatus);
  on<Job>("job", (job) => {
    jobs.value = new Map(jobs.value).set(job.id, job);
  });
  on<{ id: string }>("job_deleted", ({ id }) => {
    const left = new Map(jobs.value);
    left.delete(id);
    jobs.value = left;
  });
  on("beat", () => {});
  on("lost", () => reconnect(0));
  source.onerror = () => fail();
}

function close() {
  stream?.close();
  stream = null;
}

let retry: ReturnType<typeof setTimeout> | undefined;

function fail() {
  close();
  connection.value = link.broken(connection.value);
  reconnect(link.retryAfter(connection.value));
}

function reconnect(after_ms: number) {
  close();
  clearTimeout(retry);
  retry = setTimeout(connect, after_ms);
}

/** A new snapshot and the events after it: nothing is replayed. */
export async function connect(): Promise<void> {
  close();
  clearTimeout(retry);
  try {
    const snapshot = await read<Snapshot>("/snapshot", AbortSignal.timeout(OPEN_LIMIT_MS));
    needsLogin.value = false;
    take(snapshot);
    connection.value = link.opened(connection.value, performance.now());
    if (document.hidden) return;
    stream = new EventSource(`${API}/events?after=${snapshot.life}-${snapshot.seq}`);
    listen(stream);
  } catch (error) {
    if (error instanceof Refused && error.status === 401) {
      needsLogin.value = true;
      return;
    }
    fail();
  }
}

/** A hidden page holds no stream: browsers allow six connections a host. */
function onVisibility() {
  if (document.hidden) {
    close();
  } else {
    connect();
  }
}

export function start(): void {
  setInterval(() => {
    now.value = performance.now();
    if (stream && isOld.value && connection.value.connected) fail();
  }, TICK_MS);
  setInterval(async () => {
    if (!document.hidden || needsLogin.value) return;
    await read<Status>("/status").then(setStatus, () => {});
  }, HIDDEN_MS);
  document.addEventListener("visibilitychange", onVisibility);
}
