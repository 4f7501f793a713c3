// Builds the page into a folder: index.html and assets/NAME-HASH.*, each beside its gzip copy; the same bytes each time.
// Usage: node build.mjs FOLDER
import { createHash } from "node:crypto";
import { mkdir, readFile, rm, writeFile } from "node:fs/promises";
import { basename, join } from "node:path";
import { gzipSync } from "node:zlib";
import { build } from "esbuild";

const out = process.argv[2] ?? "dist";
await rm(out, { recursive: true, force: true });
await mkdir(join(out, "assets"), { recursive: true });

const result = await build({
  entryPoints: { main: "src/main.tsx", "live-worker": "src/view3d/live_worker.ts" },
  outdir: join(out, "assets"),
  entryNames: "[name]-[hash]",
  chunkNames: "[name]-[hash]",
  bundle: true,
  splitting: true,
  format: "esm",
  target: "es2022",
  minify: true,
  jsx: "automatic",
  jsxImportSource: "preact",
  legalComments: "none",
  metafile: true,
  logLevel: "warning",
});

const icon = await readFile("src/icon.svg");
const iconName = `icon-${createHash("sha256").update(icon).digest("hex").slice(0, 8)}.svg`;
await writeFile(join(out, "assets", iconName), icon);

const files = Object.entries(result.metafile.outputs);
const entry = files.find(([, made]) => made.entryPoint === "src/main.tsx");
const script = basename(entry[0]);
const worker = basename(files.find(([, made]) => made.entryPoint === "src/view3d/live_worker.ts")[0]);
const style = basename(entry[1].cssBundle);
// What the first screen needs besides is fetched at once, not one after the other.
const first = entry[1].imports.filter((one) => one.kind === "import-statement").map((one) => basename(one.path));
const html = (await readFile("src/index.html", "utf8"))
  .replace("<!-- icon -->", `<link rel="icon" href="/assets/${iconName}" type="image/svg+xml">`)
  .replace("<!-- worker -->", `<meta name="live-worker" content="/assets/${worker}">`)
  .replace("<!-- style -->", `<link rel="stylesheet" href="/assets/${style}">`)
  .replace(
    "<!-- script -->",
    [
      ...first.map((name) => `<link rel="modulepreload" href="/assets/${name}">`),
      `<script type="module" src="/assets/${script}"></script>`,
    ].join("\n"),
  );
await writeFile(join(out, "index.html"), html);

for (const name of ["index.html", join("assets", iconName), ...files.map(([path]) => join("assets", basename(path)))]) {
  await writeFile(join(out, `${name}.gz`), gzipSync(await readFile(join(out, name)), { level: 9 }));
}
