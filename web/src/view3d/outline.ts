// Where a horizontal plane cuts a surface.

/** Corners of the triangles in the frame of the plane, and which three make each. */
export interface Surface {
  points: Float32Array; // x y z of each
  corners: ArrayLike<number>; // three of a triangle
}

/** Segments, two points each, of the cut at this height; triangles that only touch the plane give none. */
export function cutAt({ points, corners }: Surface, height: number): Float32Array {
  const found: number[] = [];
  const y = (i: number) => points[3 * i + 1] as number;
  const between = (a: number, b: number) => {
    const share = (height - y(a)) / (y(b) - y(a));
    for (let axis = 0; axis < 3; axis++) {
      const from = points[3 * a + axis] as number;
      found.push(from + share * ((points[3 * b + axis] as number) - from));
    }
  };
  for (let t = 0; t + 2 < corners.length; t += 3) {
    const abc = [corners[t] as number, corners[t + 1] as number, corners[t + 2] as number] as const;
    const above = abc.map((i) => y(i) > height);
    for (let i = 0; i < 3; i++) {
      const next = (i + 1) % 3;
      if (above[i] !== above[next]) between(abc[i] as number, abc[next] as number);
    }
  }
  return Float32Array.from(found);
}
