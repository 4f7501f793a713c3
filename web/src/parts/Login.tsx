import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { order } from "../api/client.ts";
import { connect } from "../api/store.ts";
import { words } from "../words.ts";

const CODE = /^#code=([0-9A-Z]{8})$/;

/** A code in the address is used once and taken out of it, so that no history keeps it. */
export async function logInByAddress(): Promise<void> {
  const code = CODE.exec(location.hash)?.[1];
  if (!code) return;
  history.replaceState(null, "", location.pathname);
  await order("/login", { code }).catch(() => {});
}

export function Login() {
  const text = useSignal("");
  const problem = useSignal("");
  useEffect(() => {
    document.title = words.loginTitle;
  }, []);
  const send = async (event: Event) => {
    event.preventDefault();
    const value = text.value.trim();
    const body = value.startsWith("scanrig_") ? { token: value } : { code: value.toUpperCase() };
    try {
      await order("/login", body);
      text.value = "";
      await connect();
    } catch (error) {
      problem.value = (error as Error).message;
    }
  };
  return (
    <main class="login">
      <form class="card" onSubmit={send}>
        <h1>{words.loginTitle}</h1>
        <p class="dim">{words.loginHint}</p>
        <label>
          {words.token}
          <input
            type="password"
            autocomplete="current-password"
            value={text.value}
            onInput={(event) => {
              text.value = event.currentTarget.value;
            }}
          />
        </label>
        <button type="submit" class="big">
          {words.logIn}
        </button>
        {problem.value && (
          <p class="wrong" role="alert">
            {problem.value}
          </p>
        )}
      </form>
    </main>
  );
}
