// STOP: on every screen, for every role, on touch and not on release, never a question, alive without a connection.
import { useSignal } from "@preact/signals";
import { useRef } from "preact/hooks";
import { order } from "../api/client.ts";
import { words } from "../words.ts";

const DELIVERY_MS = 2000;
const SHOWN_MS = 3000;

type Sent = "no" | "sent" | "failed";

export function Stop() {
  const sent = useSignal<Sent>("no");
  const tries = useRef(0);

  const press = async () => {
    const mine = ++tries.current;
    const late = setTimeout(() => {
      if (mine === tries.current) sent.value = "failed";
    }, DELIVERY_MS);
    try {
      await order("/stop");
      if (mine !== tries.current) return;
      sent.value = "sent";
      setTimeout(() => {
        if (mine === tries.current && sent.value === "sent") sent.value = "no";
      }, SHOWN_MS);
    } catch {
      if (mine === tries.current) sent.value = "failed";
    } finally {
      clearTimeout(late);
    }
  };

  return (
    <div class="bottom">
      <div class="stop-place">
        <button
          type="button"
          class="stop"
          onPointerDown={press}
          onKeyDown={(event) => {
            if (!event.repeat && (event.key === "Enter" || event.key === " ")) press();
          }}
        >
          {words.stop}
        </button>
        <span role="status" class={sent.value === "failed" ? "stop-failed" : "dim"}>
          {sent.value === "failed" ? words.notDelivered : sent.value === "sent" ? words.stopping : words.notTheEstop}
        </span>
      </div>
    </div>
  );
}
