import "./theme.css";
import "./screens.css";
import { effect } from "@preact/signals";
import { render } from "preact";
import { connect, isOld, needsLogin, start, status } from "./api/store.ts";
import { Calibrate } from "./calibrate/Calibrate.tsx";
import { Jobs } from "./jobs/Jobs.tsx";
import { onKey } from "./keys.ts";
import { Model } from "./model/Model.tsx";
import { Head } from "./parts/Head.tsx";
import { Login, logInByAddress } from "./parts/Login.tsx";
import { go, place, SCREENS, type Screen, watchAddress } from "./screens.ts";
import { Service } from "./service/Service.tsx";
import { Station } from "./station/Station.tsx";
import { words } from "./words.ts";

function Nav() {
  return (
    <nav class="nav">
      {SCREENS.map((screen) => (
        <button
          key={screen}
          type="button"
          aria-current={place.value.screen === screen ? "page" : undefined}
          onClick={() => go(screen)}
        >
          {words.screens[screen]}
        </button>
      ))}
    </nav>
  );
}

function screenOf(screen: Screen) {
  switch (screen) {
    case "station":
      return <Station />;
    case "jobs":
      return <Jobs />;
    case "model":
      return <Model key={place.value.job} id={place.value.job} />;
    case "calibrate":
      return <Calibrate />;
    case "service":
      return <Service />;
    default: {
      const never: never = screen;
      return never;
    }
  }
}

function Page() {
  if (needsLogin.value) return <Login />;
  return (
    <div class={`page ${isOld.value ? "old" : ""}`}>
      <Head />
      <Nav />
      {status.value ? screenOf(place.value.screen) : <main>{words.waiting}</main>}
    </div>
  );
}

effect(() => {
  if (status.value) document.title = `${status.value.word} - scanrig`;
});
await logInByAddress();
watchAddress();
addEventListener("keydown", onKey);
start();
connect();
const root = document.getElementById("page");
if (root) render(<Page />, root);
