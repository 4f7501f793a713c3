// How the surface is coloured: as photographed, plain, by what was measured, by its standard deviation.
import {
  BufferAttribute,
  Color,
  type Material,
  type Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  type Plane,
} from "three";

export const COLOURINGS = ["texture", "shade", "measured", "sigma"] as const;
export type Colouring = (typeof COLOURINGS)[number];

/** Top of the scale of sigma; the same for every model, so that models can be compared. */
export const SIGMA_TOP_MM = 0.1;
const SIGMA_UNIT_MM = 1e-5; // of the attribute _SIGMA
const SIGMA_UNKNOWN = 65535;
// Points of cividis [Nunez, Anderton, Renslow 2018], legible without red or green.
const CIVIDIS = ["#00224e", "#35456c", "#666970", "#948e77", "#c8b866", "#fee838"].map((one) => new Color(one));
const UNMEASURED = new Color("#9a5b2f");
const MEASURED = new Color("#8fb6cf");

export function cividis(share: number): Color {
  const at = Math.min(Math.max(share, 0), 1) * (CIVIDIS.length - 1);
  const index = Math.min(Math.floor(at), CIVIDIS.length - 2);
  const from = CIVIDIS[index] as Color;
  return from.clone().lerp(CIVIDIS[index + 1] as Color, at - index);
}

function perVertex(mesh: Mesh, name: string, colour: (value: number) => Color): BufferAttribute | null {
  const values = mesh.geometry.getAttribute(name);
  if (!values) return null;
  const colours = new Float32Array(3 * values.count);
  for (let i = 0; i < values.count; i++) colour(values.getX(i)).toArray(colours, 3 * i);
  return new BufferAttribute(colours, 3);
}

/** Stripes where no view measured the surface, so that it is told without colours too. */
function striped(material: MeshStandardMaterial): MeshStandardMaterial {
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader.replace(
      "void main() {",
      "attribute float _views;\nvarying float vViews;\nvoid main() {\n  vViews = _views;",
    );
    shader.fragmentShader = shader.fragmentShader
      .replace("void main() {", "varying float vViews;\nvoid main() {")
      .replace(
        "#include <color_fragment>",
        "#include <color_fragment>\nif (vViews < 0.5 && mod(gl_FragCoord.x + gl_FragCoord.y, 12.0) < 5.0) diffuseColor.rgb *= 0.35;",
      );
  };
  return material;
}

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
    looks.measured = wear(striped(new MeshStandardMaterial({ ...plain, vertexColors: true })), measured);
  }
  const sigma = perVertex(mesh, "_sigma", (value) =>
    value === SIGMA_UNKNOWN ? UNMEASURED : cividis((value * SIGMA_UNIT_MM) / SIGMA_TOP_MM),
  );
  if (sigma) looks.sigma = wear(striped(new MeshStandardMaterial({ ...plain, vertexColors: true })), sigma);
  return looks;
}
