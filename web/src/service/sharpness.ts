// Figures of a picture that an operator focuses and exposes by.

export interface Pixels {
  width: number;
  height: number;
  data: ArrayLike<number>; // RGBA
}

export interface Exposure {
  dark: number; // share of the pixels
  bright: number;
}

const DARK = 16; // of 255
const BRIGHT = 250;

function grey({ data }: Pixels, i: number): number {
  return 0.299 * (data[4 * i] ?? 0) + 0.587 * (data[4 * i + 1] ?? 0) + 0.114 * (data[4 * i + 2] ?? 0);
}

/** Mean square of the second differences over the mean brightness: largest in focus, whatever the exposure. */
export function sharpnessOf(pixels: Pixels): number {
  const { width, height } = pixels;
  let sum = 0;
  let light = 0;
  for (let y = 1; y < height - 1; y++) {
    for (let x = 1; x < width - 1; x++) {
      const i = y * width + x;
      const here = grey(pixels, i);
      const bend =
        4 * here - grey(pixels, i - 1) - grey(pixels, i + 1) - grey(pixels, i - width) - grey(pixels, i + width);
      sum += bend * bend;
      light += here;
    }
  }
  return light > 0 ? Math.sqrt(sum * Math.max((width - 2) * (height - 2), 1)) / light : 0;
}

export function exposureOf(pixels: Pixels): Exposure {
  const count = pixels.width * pixels.height;
  let dark = 0;
  let bright = 0;
  for (let i = 0; i < count; i++) {
    const value = Math.max(pixels.data[4 * i] ?? 0, pixels.data[4 * i + 1] ?? 0, pixels.data[4 * i + 2] ?? 0);
    if (value < DARK) dark++;
    if (value >= BRIGHT) bright++;
  }
  return { dark: dark / count, bright: bright / count };
}
