// Shapes of the API's replies, as far as the page reads them: /api/v1/openapi.json describes all of them, and a test
// holds these against it.

export type Tone = "idle" | "ready" | "working" | "act" | "fault";
export type Role = "viewer" | "operator" | "engineer";

export interface Problem {
  code: string;
  message: string;
}

export interface Action {
  ok: boolean;
  why: string | null;
}

export interface StartAction extends Action {
  does: "begin" | "continue";
  offer: string;
}

export interface Device {
  name: string;
  ok: boolean;
  problem: Problem | null;
}

export interface LastOrder {
  what: string;
  who: string;
  when: string;
}

export interface Status {
  machine: string;
  activity: string;
  may_be_moving: boolean;
  standstill: "confirmed" | "pending" | "moving" | "unknown";
  cause: string;
  sentence: string;
  next_action: string;
  tone: Tone;
  word: string;
  actions: { start: StartAction; stop: Action; reset: Action };
  devices: Device[];
  job: string | null;
  not_started: { job: string; why: Problem } | null;
  queue: string[];
  last_order: LastOrder | null;
}

export type JobState =
  | "queued"
  | "scanning"
  | "waiting_for_flip"
  | "reconstructing"
  | "done"
  | "failed"
  | "interrupted"
  | "cancelled";

export interface StoredView {
  pose: number;
  view: number;
  retakes: number;
}

export interface Suggestion {
  number: number; // from 1
  sentence: string;
  doubt: string; // empty: none
  image: boolean;
}

export interface Choice {
  number: number; // from 1
  sentence: string;
  image: string; // a file of the job; empty: none
  picked: boolean;
}

export interface Job {
  id: string;
  state: JobState;
  kind: "scan" | "calibration" | "check";
  sentence: string;
  next_action: string;
  recipe: string;
  part: string;
  poses: number;
  views: number;
  all_views: number;
  stored: StoredView[];
  resumable: boolean;
  quarantined: boolean;
  exported: boolean;
  passed: boolean | null;
  model: string;
  report: string;
  remarks: string[];
  error: Problem | null;
  stages: { name: string; fraction: number }[];
  live: string[]; // meshes of what the scan shows so far
  choices: Choice[]; // ways in which pose 2 fits, of which a person picks one
  suggestions: Suggestion[]; // how the part can lie in the next pose, best first
}

export interface Health {
  ok: boolean;
  problems: Problem[];
  reminders: string[];
  version: string;
  uptime_s: number;
  devices: Device[];
  disk: { bytes: number; free_bytes: number };
  temperatures: { sensor: string; celsius: number }[];
  deadlines_missed: number;
  retakes: number;
  faults: number;
  connections: number;
  event_streams: number;
}

export interface Finding {
  id: string;
  problem: string;
  remedy: string;
}

export interface Doctor {
  time: string | null;
  findings: Finding[];
}

export interface Login {
  role: Role;
  name: string | null;
  cookie: boolean;
}

export interface Snapshot {
  life: string;
  seq: number;
  time: string;
  build: string;
  status: Status;
  jobs: Job[];
  health: Health;
  login: Login;
  insecure: boolean;
}

export interface Io {
  inputs: Record<string, boolean>;
  outputs: Record<string, boolean>;
}

export interface Placement {
  number: number;
  instruction: string;
}

export interface BoardInImage {
  seen: boolean;
  problem: string | null;
  outline: [number, number][];
  expected: [number, number][];
}

export interface CalibrationState {
  job: {
    id: string;
    state: JobState;
    sentence: string;
    next_action: string;
    placements_complete: number;
    plan: Placement[];
    verdict: "holds" | "moved" | "calibrate" | null;
    grade: string | null;
    sentences: string[];
    accepted: boolean;
  } | null;
  reminder: string | null;
  awaited_placement: number | null;
  board: {
    sentence: string;
    accepted: boolean;
    off_deg: number | null;
    off_mm: number | null;
    left: BoardInImage;
    right: BoardInImage;
  } | null;
}

export interface Recipe {
  name: string;
  poses: number;
  views: number; // of each pose
}

export interface LogLine {
  number: number;
  time: string;
  priority: "error" | "warning" | "notice" | "info";
  job: string;
  device: string;
  message: string;
}

export interface FileList {
  files: { path: string; bytes: number; type: string }[];
}

export interface RulerEnd {
  point: [number, number, number];
  measured: boolean;
  sigma_mm: number | null;
}

export interface Length {
  mm: number;
  expanded_uncertainty_mm: number | null;
  from: RulerEnd;
  to: RulerEnd;
}

export interface ConfigCheck {
  ok: boolean;
  problems: string[]; // a sentence each
}

export interface SetupOption {
  text: string;
  image: boolean;
}

export interface SetupQuestion {
  number: number;
  kind: "yes_or_no" | "number" | "choice" | "done";
  text: string;
  min: number;
  max: number;
  options: SetupOption[];
}

export interface Setup {
  phase: "none" | "lending" | "working" | "found" | "written" | "examined" | "failed";
  who: string | null;
  owner: boolean; // this page may answer
  refused: string | null; // why it could not begin now
  told: string[];
  question: SetupQuestion | null;
  draft: string | null; // the rig.toml that was found
  problem: string | null;
}

export interface SetupKey {
  key: string;
}

export interface Reference {
  name: string;
  bytes: number;
}

export interface Deviation {
  reference: string;
  model_file: string;
  values_file: string;
  vertices: number;
  confirmed: number;
  fits_otherwise: boolean;
  known_share: number;
  mean_mm: number;
  rms_mm: number;
  p95_mm: number; // of the absolute values
  min_mm: number;
  max_mm: number;
}
