// The newest lines of the service's log.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { read } from "../api/client.ts";
import type { LogLine } from "../api/types.ts";
import { may } from "../parts/Order.tsx";
import { words } from "../words.ts";

const PERIOD_MS = 2000;
const SHOWN = 200;

export function LogCard() {
  const lines = useSignal<LogLine[]>([]);
  const mayRead = may("engineer");
  useEffect(() => {
    if (!mayRead) return;
    const ask = async () => {
      const after = lines.value.at(-1)?.number ?? 0;
      const got = await read<{ lines: LogLine[] }>(`/log?after=${after}`, AbortSignal.timeout(5000)).catch(() => null);
      if (!got?.lines.length) return;
      const hasBegunAgain = (got.lines[0]?.number ?? 0) <= after;
      lines.value = [...(hasBegunAgain ? [] : lines.value), ...got.lines].slice(-SHOWN);
    };
    ask();
    const timer = setInterval(ask, PERIOD_MS);
    return () => clearInterval(timer);
  }, [mayRead]);
  if (!mayRead) return null;
  return (
    <section class="card">
      <h2>{words.log}</h2>
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: a region that scrolls is reached by keys */}
      <div class="log" tabIndex={0} role="log" aria-label={words.log}>
        {[...lines.value].reverse().map((line) => (
          <p key={line.number} class={line.priority === "error" || line.priority === "warning" ? "wrong" : ""}>
            <span class="dim">{line.time.slice(11, 19)}</span> {line.job && `${line.job}: `}
            {line.message}
          </p>
        ))}
      </div>
    </section>
  );
}
