// How the surface is coloured: as photographed, plain, by what was measured, by its standard deviation, by its
// deviation from a reference.
import {
  BufferAttribute,
  Color,
  type Material,
  type Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  type Plane,
} from "three";

export const COLOURINGS = ["texture", "shade", "measured", "sigma", "deviation"] as const;
export type Colouring = (typeof COLOURINGS)[number];

/** Top of the scale of sigma; the same for every model, so that models can be compared. */
export const SIGMA_TOP_MM = 0.1;
const SIGMA_UNIT_MM = 1e-5; // of the attribute _SIGMA
const SIGMA_UNKNOWN = 65535;
// Points of cividis [Nunez, Anderton, Renslow 2018], legible without red or green.
const CIVIDIS = ["#00224e", "#35456c", "#666970", "#948e77", "#c8b866", "#fee838"].map((one) => new Color(one));
const UNMEASURED = new Color("#9a5b2f");
const MEASURED = new Color("#8fb6cf");
const UNKNOWN = new Color("#6b737b");
const DEVIATION_UNKNOWN = -32768; // of a file of deviations, in um
// Points of blue-white-orange: inside the reference, on it, outside.
const BLUE_WHITE_ORANGE = ["#0b5cad", "#7db4e0", "#f4f4f4", "#f0a35e", "#b34700"].map((one) => new Color(one));

function between(points: readonly Color[], share: number): Color {
  const at = Math.min(Math.max(share, 0), 1) * (points.length - 1);
  const index = Math.min(Math.floor(at), points.length - 2);
  const from = points[index] as Color;
  return from.clone().lerp(points[index + 1] as Color, at - index);
}

export function cividis(share: number): Color {
  return between(CIVIDIS, share);
}

/** Colour of a deviation on a scale from -top to top; what is not known is grey. */
export function deviationColour(um: number, top_um: number): Color {
  return um === DEVIATION_UNKNOWN ? UNKNOWN : between(BLUE_WHITE_ORANGE, 0.5 + um / (2 * top_um));
}

export function isOutside(um: number, top_um: number): boolean {
  return um !== DEVIATION_UNKNOWN && Math.abs(um) > top_um;
}

function perVertex(mesh: Mesh, name: string, colour: (value: number) => Color): BufferAttribute | null {
  const values = mesh.geometry.getAttribute(name);
  if (!values) return null;
  const colours = new Float32Array(3 * values.count);
  for (let i = 0; i < values.count; i++) colour(values.getX(i)).toArray(colours, 3 * i);
  return new BufferAttribute(colours, 3);
}

/** Stripes where the condition on the attribute holds, so that it is told without colours too. */
function striped(material: MeshStandardMaterial, attribute: string, condition: string): MeshStandardMaterial {
  material.customProgramCacheKey = () => condition;
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader.replace(
      "void main() {",
      `attribute float ${attribute};\nvarying float vStriped;\nvoid main() {\n  vStriped = ${condition} ? 1.0 : 0.0;`,
    );
    shader.fragmentShader = shader.fragmentShader
      .replace("void main() {", "varying float vStriped;\nvoid main() {")
      .replace(
        "#include <color_fragment>",
        "#include <color_fragment>\nif (vStriped > 0.5 && mod(gl_FragCoord.x + gl_FragCoord.y, 12.0) < 5.0) diffuseColor.rgb *= 0.35;",
      );
  };
  return material;
}

const unmeasured = (material: MeshStandardMaterial) => striped(material, "_views", "_views < 0.5");

export type Looks = Partial<Record<Colouring, () => void>>;

/** Ways to colour one mesh; those whose data the file does not have are missing. */
export function looksOf(mesh: Mesh, plane: Plane): Looks {
  const own = mesh.material as MeshStandardMaterial;
  const clippingPlanes = [plane];
  const plain = { roughness: 0.75, clippingPlanes, side: 2 as const };
  const wear = (material: Material, colours: BufferAttribute | null = null) => {
    return () => {
      if (colours) mesh.geometry.setAttribute("color", colours);
      mesh.material = material;
    };
  };
  const looks: Looks = {
    texture: wear(
      new MeshBasicMaterial({
        ...(own.map ? { map: own.map } : { color: "#cccccc" }),
        vertexColors: !own.map && mesh.geometry.hasAttribute("color"),
        clippingPlanes,
        side: 2,
      }),
      mesh.geometry.hasAttribute("color") ? (mesh.geometry.getAttribute("color") as BufferAttribute) : null,
    ),
    shade: wear(new MeshStandardMaterial({ ...plain, color: "#b9c3cc" })),
  };
  const measured = perVertex(mesh, "_views", (views) => (views > 0 ? MEASURED : UNMEASURED));
  if (measured) {
    looks.measured = wear(unmeasured(new MeshStandardMaterial({ ...plain, vertexColors: true })), measured);
  }
  const sigma = perVertex(mesh, "_sigma", (value) =>
    value === SIGMA_UNKNOWN ? UNMEASURED : cividis((value * SIGMA_UNIT_MM) / SIGMA_TOP_MM),
  );
  if (sigma) looks.sigma = wear(unmeasured(new MeshStandardMaterial({ ...plain, vertexColors: true })), sigma);
  return looks;
}

/** The mesh by the deviation of each of its vertices, on a scale from -top to top. */
export function deviationLook(mesh: Mesh, plane: Plane, um: Int16Array, top_um: number): () => void {
  const colours = new Float32Array(3 * um.length);
  const outside = new Float32Array(um.length);
  um.forEach((value, i) => {
    deviationColour(value, top_um).toArray(colours, 3 * i);
    outside[i] = isOutside(value, top_um) ? 1 : 0;
  });
  const material = striped(
    new MeshStandardMaterial({ roughness: 0.75, clippingPlanes: [plane], side: 2, vertexColors: true }),
    "_outside",
    "_outside > 0.5",
  );
  return () => {
    mesh.geometry.setAttribute("color", new BufferAttribute(colours, 3));
    mesh.geometry.setAttribute("_outside", new BufferAttribute(outside, 1));
    mesh.material = material;
  };
}
