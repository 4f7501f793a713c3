// scanrig setup on the page: what it finds, what it asks, the file that it would write. The daemon decides all of it.
import { useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { API, order, read } from "../api/client.ts";
import type { Setup, SetupKey, SetupQuestion } from "../api/types.ts";
import { may, Order } from "../parts/Order.tsx";
import { go } from "../screens.ts";
import { words } from "../words.ts";

const PERIOD_MS = 500;
const KEY = "scanrig-setup"; // a page that is loaded again goes on

const key = () => sessionStorage.getItem(KEY) ?? "";

function answer(question: SetupQuestion, reply: string) {
  return order("/setup/reply", { key: key(), number: question.number, text: reply });
}

function NumberField({ question }: { question: SetupQuestion }) {
  const text = useSignal("");
  return (
    <div class="row">
      <label>
        {words.setupNumber(question.min, question.max)}
        <input
          inputMode="decimal"
          value={text.value}
          onInput={(event) => {
            text.value = event.currentTarget.value;
          }}
        />
      </label>
      <Order needs="engineer" send={() => answer(question, text.value.trim().replace(",", "."))}>
        {words.setupSend}
      </Order>
    </div>
  );
}

function Options({ question }: { question: SetupQuestion }) {
  return (
    <ol class="setup-options">
      {question.options.map((option, i) => (
        <li key={option.text} class="stack">
          {option.image && <img src={`${API}/setup/image/${i}?of=${question.number}`} alt={option.text} />}
          <Order needs="engineer" send={() => answer(question, String(i + 1))}>
            {option.text}
          </Order>
        </li>
      ))}
    </ol>
  );
}

function Answers({ question }: { question: SetupQuestion }) {
  switch (question.kind) {
    case "yes_or_no":
      return (
        <div class="row">
          <Order needs="engineer" send={() => answer(question, "y")}>
            {words.yes}
          </Order>
          <Order needs="engineer" send={() => answer(question, "n")}>
            {words.no}
          </Order>
        </div>
      );
    case "number":
      return <NumberField question={question} />;
    case "choice":
      return <Options question={question} />;
    case "done":
      return (
        <Order needs="engineer" send={() => answer(question, "")}>
          {words.setupDone}
        </Order>
      );
    default: {
      const never: never = question.kind;
      return never;
    }
  }
}

const step = (what: "accept" | "repeat" | "doctor") => () => order(`/setup/${what}`, { key: key() });

function Step({ what, children }: { what: "accept" | "repeat" | "doctor"; children: string }) {
  return (
    <Order needs="engineer" send={step(what)}>
      {children}
    </Order>
  );
}

/// What its owner can do in this phase, beside ending it.
function Steps({ now }: { now: Setup }) {
  switch (now.phase) {
    case "none":
    case "lending":
    case "working":
      return null;
    case "found":
      return (
        <>
          <Step what="accept">{words.setupAccept}</Step>
          <Step what="repeat">{words.setupRepeat}</Step>
        </>
      );
    case "written":
      return <Step what="doctor">{words.setupDoctor}</Step>;
    case "examined":
      return <Step what="doctor">{words.setupDoctorAgain}</Step>;
    case "failed":
      return <Step what="repeat">{words.setupRepeat}</Step>;
    default: {
      const never: never = now.phase;
      return never;
    }
  }
}

/// The newest line is what a person may have to do at the rig now.
function Told({ lines }: { lines: string[] }) {
  const box = useRef<HTMLElement>(null);
  useEffect(() => {
    box.current?.scrollTo({ top: box.current.scrollHeight });
  }, [lines.length]);
  return (
    // biome-ignore lint/a11y/noNoninteractiveTabindex: what scrolls must be reachable by keys
    <section class="setup-told" ref={box} tabIndex={0} aria-label={words.setupTold}>
      <pre>{lines.join("\n")}</pre>
    </section>
  );
}

/// While it works, what it does or wants at the rig.
function sentence({ phase, question, told }: Setup) {
  if (phase !== "working") return words.setupPhases[phase];
  return question ? words.setupAsks : (told.at(-1) ?? words.setupPhases.working);
}

function Conversation({ now }: { now: Setup }) {
  const { question } = now;
  return (
    <>
      <p role="status">{sentence(now)}</p>
      {now.told.length > 0 && <Told lines={now.told} />}
      {now.problem && <p class="wrong">{now.problem}</p>}
      {now.draft && (
        // biome-ignore lint/a11y/noNoninteractiveTabindex: what scrolls must be reachable by keys
        <section class="setup-draft" tabIndex={0} aria-label={words.setupDraft}>
          <pre>{now.draft}</pre>
        </section>
      )}
      {question && now.owner && (
        <div key={question.number} class="stack setup-question">
          <h3>{question.text}</h3>
          <Answers question={question} />
        </div>
      )}
      {!now.owner && <p>{words.setupOther(now.who ?? "")}</p>}
      <div class="row">
        {now.owner && <Steps now={now} />}
        <Order needs="engineer" hold send={() => order("/setup/end")}>
          {words.hold(now.phase === "written" || now.phase === "examined" ? words.setupStart : words.setupEnd)}
        </Order>
      </div>
    </>
  );
}

/// Only while maintenance is on does the daemon lend the devices.
export function SetupCard() {
  const now = useSignal<Setup | null>(null);
  const wasHere = useSignal(false);
  const mayAsk = may("engineer");
  useEffect(() => {
    if (!mayAsk) return;
    const ask = () =>
      read<Setup>(`/setup?key=${encodeURIComponent(key())}`, AbortSignal.timeout(5000)).then(
        (got) => {
          if (now.value?.owner && got.phase === "none") wasHere.value = true;
          now.value = got;
        },
        () => {}, // the service restarts: the head of the page says so
      );
    ask();
    const timer = setInterval(ask, PERIOD_MS);
    return () => clearInterval(timer);
  }, [mayAsk]);
  const state = now.value;
  if (!mayAsk || !state) return null;
  const begin = async () => {
    sessionStorage.setItem(KEY, (await order<SetupKey>("/setup/begin")).key);
  };
  return (
    <section class="card">
      <h2>{words.setup}</h2>
      {state.phase !== "none" && <Conversation now={state} />}
      {state.phase === "none" && (
        <>
          <p class="dim">{words.setupHow}</p>
          <Order needs="engineer" send={begin} action={{ ok: state.refused === null, why: state.refused }}>
            {words.setupBegin}
          </Order>
          {wasHere.value && (
            <>
              <p>{words.setupNext}</p>
              <button type="button" onClick={() => go("calibrate")}>
                {words.screens.calibrate}
              </button>
            </>
          )}
        </>
      )}
    </section>
  );
}
