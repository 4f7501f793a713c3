// A button that sends an order and shows the daemon's refusal beside it.
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { isDeaf, isOld, login } from "../api/store.ts";
import type { Action, Role } from "../api/types.ts";

const ORDER: Role[] = ["viewer", "operator", "engineer"];
const HOLD_MS = 1000;

export const may = (role: Role): boolean => ORDER.indexOf(login.value?.role ?? "viewer") >= ORDER.indexOf(role);

interface Props {
  needs: Role;
  send: () => Promise<unknown>;
  children: ComponentChildren;
  action?: Action; // why the daemon would refuse it
  class?: string;
  hold?: boolean; // only when it is held for a second
}

export function Order({ needs, send, children, action, class: looks = "", hold = false }: Props) {
  const problem = useSignal("");
  const busy = useSignal(false);
  const held = useSignal(false);
  const timer = useRef<ReturnType<typeof setTimeout>>();
  useEffect(() => () => clearTimeout(timer.current), []);
  if (!may(needs)) return null; // never allowed: not shown

  const run = async () => {
    busy.value = true;
    problem.value = "";
    await send().catch((error: Error) => {
      problem.value = error.message;
    });
    busy.value = false;
  };
  const release = () => {
    clearTimeout(timer.current);
    held.value = false;
  };
  const press = () => {
    held.value = true;
    timer.current = setTimeout(() => {
      release();
      run();
    }, HOLD_MS);
  };
  const gestures = hold
    ? {
        onPointerDown: press,
        onPointerUp: release,
        onPointerLeave: release,
        onKeyDown: (event: KeyboardEvent) => {
          if (!event.repeat && event.key === "Enter") press();
        },
        onKeyUp: release,
        onBlur: release,
      }
    : { onClick: run };
  const refused = action && !action.ok;
  return (
    <div class="stack">
      <button
        type="button"
        class={`${looks} ${hold ? "held" : ""} ${held.value ? "held-on" : ""}`}
        disabled={busy.value || isOld.value || isDeaf.value || refused}
        {...gestures}
      >
        {children}
        {hold && <span class="held-bar" aria-hidden="true" />}
      </button>
      {refused && action.why && <p class="why">{action.why}</p>}
      {problem.value && (
        <p class="wrong" role="alert">
          {problem.value}
        </p>
      )}
    </div>
  );
}
