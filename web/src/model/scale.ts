// Scales of a colouring by deviation, in mm.
export const TOPS_MM = [0.05, 0.1, 0.2, 0.5, 1, 2, 5] as const;

/** The smallest scale that holds 95 % of the vertices. */
export function topFor(p95_mm: number): number {
  return TOPS_MM.find((top) => top >= p95_mm) ?? 5;
}
