// A thread of its own, which a busy test does not hold up: posts the daemon's events, each with the time of its arrival.
import { get } from "node:http";
import { parentPort, workerData } from "node:worker_threads";

let text = "";
get({ socketPath: workerData, path: "/api/v1/events", headers: { Host: "localhost" } }, (reply) =>
  reply.on("data", (chunk) => {
    text += chunk;
    for (let end = text.indexOf("\n\n"); end >= 0; end = text.indexOf("\n\n")) {
      const name = /^event: (.*)$/m.exec(text.slice(0, end))?.[1];
      const data = /^data: (.*)$/m.exec(text.slice(0, end))?.[1];
      if (name && data) parentPort.postMessage({ name, data: JSON.parse(data), at: Date.now() });
      text = text.slice(end + 2);
    }
  }),
).on("error", () => {});
