// A segment a view: what is stored, what was taken again.
import type { Job } from "../api/types.ts";

export interface Segment {
  key: string;
  from: number; // of a turn, clockwise from the top
  to: number;
  stored: boolean;
  retaken: boolean;
}

const GAP = 0.006;

export function segments(job: Pick<Job, "poses" | "views" | "all_views" | "stored">): Segment[] {
  const count = Math.max(job.all_views, 1);
  const stored = [...job.stored].sort((a, b) => a.pose - b.pose || a.view - b.view);
  return Array.from({ length: count }, (_, at) => {
    const view = stored[at];
    return {
      key: `${at}`,
      from: at / count + GAP,
      to: (at + 1) / count - GAP,
      stored: view !== undefined,
      retaken: (view?.retakes ?? 0) > 0,
    };
  });
}

/** The path of an arc in a box of 100 by 100. */
export function arc(from: number, to: number, radius = 42): string {
  const at = (turn: number) => {
    const angle = turn * 2 * Math.PI;
    return `${(50 + radius * Math.sin(angle)).toFixed(2)} ${(50 - radius * Math.cos(angle)).toFixed(2)}`;
  };
  return `M ${at(from)} A ${radius} ${radius} 0 ${to - from > 0.5 ? 1 : 0} 1 ${at(to)}`;
}
