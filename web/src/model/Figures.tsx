import { useSignal } from "@preact/signals";
import { Fragment } from "preact";
import { useEffect } from "preact/hooks";
import { read } from "../api/client.ts";
import { figuresOf, type Report } from "./report.ts";

/** Nothing until the report is there, and where there is none. */
export function Figures({ job, model }: { job: string; model: string }) {
  const report = useSignal<Report>({});
  useEffect(() => {
    report.value = {};
    if (!model) return;
    read<Report>(`/jobs/${encodeURIComponent(job)}/report`).then(
      (got) => {
        report.value = got;
      },
      () => {},
    );
  }, [job, model]);
  const figures = figuresOf(report.value);
  if (figures.length === 0) return null;
  return (
    <dl class="facts">
      {figures.map(({ name, text }) => (
        <Fragment key={name}>
          <dt>{name}</dt>
          <dd>{text}</dd>
        </Fragment>
      ))}
    </dl>
  );
}
