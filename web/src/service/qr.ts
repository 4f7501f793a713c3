/** A QR code of `text` as the address of an image. Its library is fetched when the first one is wanted. */
export async function qrSvg(text: string): Promise<string> {
  const { default: qrcode } = await import("qrcode-generator");
  const code = qrcode(0, "M");
  code.addData(text);
  code.make();
  const svg = code.createSvgTag({ cellSize: 4, margin: 0, scalable: true });
  return URL.createObjectURL(new Blob([svg], { type: "image/svg+xml" }));
}
