import type { Job, JobState } from "../api/types.ts";
import type { words } from "../words.ts";

export type Filter = keyof typeof words.filters;

const TROUBLE = new Set<JobState>(["failed", "interrupted"]);

export function chosen(filter: Filter, job: Pick<Job, "id" | "state" | "passed">, queue: readonly string[]): boolean {
  if (filter === "queue") return queue.includes(job.id);
  if (filter === "trouble") return TROUBLE.has(job.state) || job.passed === false;
  return true;
}
