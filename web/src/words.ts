// Every word of the page's own. Sentences about the rig, and what to do next, are the daemon's.
import type { Deviation, Job, LastOrder, Length, Role } from "./api/types.ts";

export const words = {
  screens: { station: "Station", jobs: "Jobs", model: "Model", calibrate: "Calibrate", service: "Service" },
  stop: "STOP",
  stopping: "STOP SENT",
  notDelivered: "NOT DELIVERED. Use the red button.",
  notTheEstop: "This is not the emergency stop.",
  start: "START",
  reset: "Reset",
  lost: (seconds: number) => `Connection lost. Last known state ${seconds} s ago.`,
  waiting: "Waiting for the rig.",
  insecure: "This connection is not encrypted: others on the network can read tokens.",
  lastOrder: ({ what, who, when }: LastOrder) => `Last order: ${what} (${who}), ${clock(when)}.`,
  startDoes: { begin: "Begins the next scan.", continue: "Continues the scan." },
  nextJob: "Next job",
  noJob: "No job is queued: Start takes the default recipe.",
  left: "Left camera",
  right: "Right camera",
  noPicture: "No picture",
  frozen: "old picture",
  progress: (stored: number, all: number) => `${stored} of ${all} views stored`,
  live: "Measured so far",
  flipPicture: "Turn the object over, to stand on another side.",
  suggested: (number: number) => (number === 1 ? "Best next side" : "Or else"),
  suggestionKey: "Orange: not seen so far.",
  devices: "Devices",
  queue: "Queue",
  filters: { all: "All", queue: "Queue", trouble: "Trouble" },
  noJobs: "No jobs.",
  more: "Show more",
  part: "Part",
  recipe: "Recipe",
  recipeOf: (name: string, poses: number, views: number) => `${name}: ${poses} × ${views} views`,
  orderScan: "Queue a scan",
  hold: (what: string) => `${what}: hold`,
  cancel: "Cancel",
  remove: "Delete",
  resume: "Resume",
  first: "Do next",
  exported: "Mark as exported",
  reprocess: "Reprocess",
  addPose: "Add a pose",
  choice: (number: number, picked: boolean) => (picked ? `${number}: picked` : `${number}`),
  choiceShown: (number: number) => `The part as choice ${number} joins its poses: from the front and from behind`,
  choose: (number: number) => `Number ${number} is right`,
  choiceKey: "Left: from the cameras. Right: from the other side. A pose that is added decides, too.",
  showModel: "Show model",
  download: "Download",
  files: "Files",
  chooseJob: "Choose a finished job.",
  loading: "Loading the model.",
  noModel: "This job has no model.",
  colourings: { texture: "Texture", shade: "Shade", measured: "Measured", sigma: "Sigma", deviation: "Deviation" },
  legends: {
    texture: "",
    shade: "",
    measured: "Striped: closed by silhouettes or the table, not measured.",
    sigma: "Standard deviation along the normal, 0 to 0.1 mm. Striped: not measured.",
    deviation: "Blue: inside the reference. Orange: outside. Striped: beyond the scale. Grey: not known.",
  },
  reference: "Compare with",
  noReference: "nothing",
  comparing: "Comparing. This takes some seconds.",
  otherFile: "The model has changed: load the page again.",
  deviationTop: "Scale",
  mm: (value: number) => `${value} mm`,
  deviationFigures: (one: Deviation) =>
    `Best fit: ${signed(one.mean_mm)} mm on average, 95 % within ${one.p95_mm.toFixed(3)} mm, from ${signed(one.min_mm)} to ${signed(one.max_mm)} mm; ${Math.round(100 * one.known_share)} % of the vertices known.${
      one.fits_otherwise ? " The part is symmetric: the reference fits in other ways too." : ""
    }`,
  section: "Section",
  ruler: "Ruler",
  rulerHint: "Tap two points of the surface.",
  measuring: "Measuring.",
  length: (one: Length) =>
    one.expanded_uncertainty_mm === null
      ? `${one.mm.toFixed(2)} mm, ${
          one.from.measured && one.to.measured ? "uncertainty not known: see the calibration" : "an end is not measured"
        }`
      : `${one.mm.toFixed(3)} mm ± ${one.expanded_uncertainty_mm.toFixed(3)} mm (k = 2)`,
  facts: "Facts",
  figures: {
    surface: "Surface",
    surfaceIs: (mm2: number, share: number) => `${(mm2 / 100).toFixed(1)} cm², ${(100 * share).toFixed(1)} % measured`,
    volume: "Volume",
    volumeIs: (mm3: number) => `${(mm3 / 1000).toFixed(2)} cm³`,
    views: "Views",
    viewsAgree: (mm: number) => `agree to ${mm.toFixed(3)} mm (median)`,
    pose: (number: number) => `Pose ${number}`,
    poseIs: (deg: number, mm: number) =>
      `± ${deg.toFixed(4)}° and ± ${mm.toFixed(4)} mm in the least certain direction (k = 1)`,
    turnIsOpen: (mm: number) =>
      `± ${mm.toFixed(4)} mm in the least certain direction (k = 1), any turn of its symmetry`,
  },
  passed: "within the limits",
  below: "outside the limits",
  loginTitle: "Log in",
  loginHint: "A token of scanrig token add, or the code that scanrig open shows.",
  token: "Token or code",
  logIn: "Log in",
  logOut: "Log out",
  access: "Access",
  you: (role: Role, name: string | null) => (name ? `${name}, ${role}` : role),
  offerCode: "Show a code for another device",
  codeValid: (seconds: number) => `Valid for ${seconds / 60} minutes, once.`,
  health: "Health",
  allWell: "Nothing is wrong.",
  ago: (minutes: number) => {
    if (minutes < 1) return "just now";
    if (minutes < 120) return `${minutes} min ago`;
    return minutes < 48 * 60 ? `${Math.floor(minutes / 60)} h ago` : `${Math.floor(minutes / (24 * 60))} days ago`;
  },
  doctor: "Doctor",
  doctorNever: "The rig was not examined yet.",
  doctorHow: "To examine the rig, stop the service and run scanrig doctor.",
  doctorWell: (age: string) => `Examined ${age}: nothing was wrong.`,
  doctorFound: (age: string, count: number) => `Examined ${age}: ${count === 1 ? "1 finding" : `${count} findings`}.`,
  config: "Configuration",
  configHow: "After a change by hand. Devices that were connected anew are found by setup.",
  setup: "Setup",
  setupHow:
    "Finds what is connected, asks the rest and writes rig.toml. The rig is stopped and the service lends its devices; nothing moves. Be at the rig: it asks for its buttons.",
  setupBegin: "Find the devices",
  setupPhases: {
    none: "",
    lending: "The service closes its devices.",
    working: "At work.",
    found: "This rig.toml was found. Read it, then accept it. The present one is kept as rig.toml.old.",
    written: "rig.toml is replaced. The doctor can examine the rig: the projector flashes, nothing turns.",
    examined: "The doctor has examined the rig.",
    failed: "Setup could not continue.",
  },
  setupAsks: "Setup needs your reply.",
  setupTold: "What setup found",
  setupDraft: "The new rig.toml",
  setupOther: (who: string) => `${who} has begun setup in another browser.`,
  setupAccept: "Accept",
  setupRepeat: "Look again",
  setupDoctor: "Run the doctor",
  setupDoctorAgain: "Run the doctor again",
  setupStart: "Start the service",
  setupEnd: "End here",
  setupNext: "Now press Reset at the rig, set focus and exposure below, then calibrate.",
  setupNumber: (min: number, max: number) => `${min} to ${max}`,
  setupSend: "Send",
  setupDone: "Done",
  yes: "Yes",
  no: "No",
  configCheck: "Check the file",
  configValid: "The file is valid.",
  configReload: "Restart with the file",
  table: "Table",
  inputs: "Inputs",
  outputs: "Outputs",
  maintenanceOn: "Begin maintenance",
  maintenanceOff: "End maintenance",
  home: "Home",
  jog: (deg: number) => `${deg > 0 ? "+" : ""}${deg}°`,
  flash: "Flash",
  lampTest: "Lamp test",
  on: "on",
  off: "off",
  focus: "Focus and exposure",
  focusHint:
    "The middle of each image in full resolution. Turn the lens until the bar is at its longest, then lock it.",
  focusBegin: "Show",
  focusEnd: "Hide",
  sharpness: "Sharpness",
  sharpnessOf: (share: number) => `${Math.round(100 * share)} % of the sharpest so far`,
  exposure: (dark: number, bright: number) =>
    `· ${(100 * dark).toFixed(0)} % dark, ${(100 * bright).toFixed(1)} % overexposed`,
  log: "Log",
  disk: (free: string, all: string) => `${free} free of ${all}`,
  uptime: (hours: string) => `${hours} h up`,
  version: "Version",
  calibrationBegin: "Calibrate",
  calibrationCheck: "Check",
  calibrationAccept: "Accept",
  calibrationAbort: "Abort",
  placement: (number: number, all: number) => `Placement ${number} of ${all}`,
  grade: (grade: string) => `Grade ${grade}`,
  accepted: "In use.",
  boardOff: (deg: number | null, mm: number | null) =>
    deg === null || mm === null ? "" : `${deg.toFixed(1)}° and ${mm.toFixed(0)} mm off`,
  needs: (role: Role) => `needs the role ${role}`,
  verdicts: { holds: "It holds.", moved: "Something has moved.", calibrate: "A calibration is due." },
} as const;

const clock = (time: string) => new Date(time).toLocaleTimeString("en-GB");
const signed = (mm: number) => `${mm > 0 ? "+" : ""}${mm.toFixed(3)}`;

export interface Badge {
  word: string;
  tone: "idle" | "ready" | "working" | "act" | "fault";
}

/** One badge a job, from its state alone. */
export function badge(job: Pick<Job, "state" | "passed" | "stages" | "stored" | "all_views">): Badge {
  switch (job.state) {
    case "queued":
      return { word: "QUEUED", tone: "idle" };
    case "scanning":
      return { word: `SCANNING ${job.stored.length}/${job.all_views}`, tone: "working" };
    case "waiting_for_flip":
      return { word: "FLIP", tone: "act" };
    case "reconstructing": {
      const stage = job.stages.at(-1);
      return { word: stage ? `MODEL ${stage.name} ${Math.round(stage.fraction * 100)} %` : "MODEL", tone: "working" };
    }
    case "done":
      return job.passed === false ? { word: "BELOW LIMITS", tone: "act" } : { word: "DONE", tone: "ready" };
    case "failed":
      return { word: "FAILED", tone: "fault" };
    case "interrupted":
      return { word: "INTERRUPTED", tone: "act" };
    case "cancelled":
      return { word: "CANCELLED", tone: "idle" };
    default: {
      const never: never = job.state;
      return never;
    }
  }
}

/** Whole minutes from a time of the daemon until now; 0 where the clocks disagree. */
export function minutesSince(time: string, now_ms = Date.now()) {
  return Math.max(0, Math.floor((now_ms - Date.parse(time)) / 60000));
}

export function bytes(count: number): string {
  const units = ["B", "kB", "MB", "GB", "TB"];
  let value = count;
  let unit = 0;
  while (value >= 1000 && unit < units.length - 1) {
    value /= 1000;
    unit++;
  }
  return `${value >= 100 || unit === 0 ? value.toFixed(0) : value.toFixed(1)} ${units[unit]}`;
}
