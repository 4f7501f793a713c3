// What scanrig calibrate --rig says and shows, with the board's outline in the images.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { order, read } from "../api/client.ts";
import { status } from "../api/store.ts";
import type { BoardInImage, CalibrationState } from "../api/types.ts";
import { Order } from "../parts/Order.tsx";
import { Picture, type Size } from "../station/Picture.tsx";
import { words } from "../words.ts";

const PERIOD_MS = 1000;
const SIDES = ["left", "right"] as const;

function Outline({ board, size }: { board: BoardInImage | undefined; size: Size }) {
  if (!board) return null;
  const points = (corners: [number, number][]) => corners.map((one) => one.join(",")).join(" ");
  return (
    <svg viewBox={`0 0 ${size[0]} ${size[1]}`} aria-hidden="true">
      {board.expected.length > 0 && <polygon class="ghost" points={points(board.expected)} />}
      {board.outline.length > 0 && <polygon class="seen" points={points(board.outline)} />}
    </svg>
  );
}

function Orders({ state }: { state: CalibrationState }) {
  const job = state.job;
  const running = job !== null && ["queued", "scanning", "waiting_for_flip", "reconstructing"].includes(job.state);
  const start = status.value?.actions.start;
  return (
    <div class="row">
      {!running && (
        <>
          <Order needs="engineer" class="big" send={() => order("/calibration/begin")}>
            {words.calibrationBegin}
          </Order>
          <Order needs="engineer" class="big" send={() => order("/calibration/check")}>
            {words.calibrationCheck}
          </Order>
        </>
      )}
      {running && start && (
        <Order needs="operator" class="big" action={start} send={() => order("/start", { offer: start.offer })}>
          {words.start}
        </Order>
      )}
      {running && (
        <Order needs="engineer" hold send={() => order("/calibration/abort")}>
          {words.hold(words.calibrationAbort)}
        </Order>
      )}
      {job && job.state === "done" && !job.accepted && job.verdict !== "holds" && (
        <Order needs="engineer" class="big" send={() => order("/calibration/accept")}>
          {words.calibrationAccept}
        </Order>
      )}
    </div>
  );
}

function Progress({ job }: { job: NonNullable<CalibrationState["job"]> }) {
  const placement = job.plan[job.placements_complete];
  return (
    <section class="card">
      <h2>
        {placement
          ? words.placement(job.placements_complete + 1, job.plan.length)
          : job.grade
            ? words.grade(job.grade)
            : ""}
      </h2>
      <p>{job.sentence}</p>
      <p class="dim">{job.next_action}</p>
      {placement && <p>{placement.instruction}</p>}
      {job.verdict && <p>{words.verdicts[job.verdict]}</p>}
      {job.sentences.map((sentence) => (
        <p key={sentence}>{sentence}</p>
      ))}
      {job.accepted && <p>{words.accepted}</p>}
    </section>
  );
}

export function Calibrate() {
  const state = useSignal<CalibrationState | null>(null);
  const problem = useSignal("");
  useEffect(() => {
    let ended = false;
    let timer: ReturnType<typeof setTimeout>;
    const ask = async () => {
      try {
        state.value = await read<CalibrationState>("/calibration", AbortSignal.timeout(5000));
        problem.value = "";
      } catch (error) {
        problem.value = (error as Error).message;
      }
      if (!ended) timer = setTimeout(ask, PERIOD_MS);
    };
    ask();
    return () => {
      ended = true;
      clearTimeout(timer);
    };
  }, []);
  const now = state.value;
  return (
    <main class="columns">
      <div class="pictures">
        {SIDES.map((side) => (
          <Picture key={side} side={side} over={(size) => <Outline board={now?.board?.[side]} size={size} />} />
        ))}
      </div>
      <div class="stack">
        {problem.value && <p class="wrong">{problem.value}</p>}
        {now?.reminder && <p class="card">{now.reminder}</p>}
        {now?.board && (
          <p class="card">
            {now.board.accepted ? "✓ " : ""}
            {now.board.sentence} {words.boardOff(now.board.off_deg, now.board.off_mm)}
          </p>
        )}
        {now?.job && <Progress job={now.job} />}
        {now && <Orders state={now} />}
      </div>
    </main>
  );
}
