// What report.json says of a model, in lines for the page.
import { words } from "../words.ts";

interface Uncertainty {
  rotation_deg: { sigma: number[] }; // the least certain direction first
  translation_mm: { sigma: number[] };
}

export interface Report {
  poses?: { residual_median_mm: number | null }[];
  pose_refinement?: {
    turn_is_open?: boolean; // the part has a turn that changes nothing
    uncertainty?: Uncertainty;
    poses?: { pose: number; uncertainty: Uncertainty }[];
  };
  mesh?: { area_mm2: number; measured_share: number; volume_mm3?: number | null };
}

export interface Figure {
  name: string;
  text: string;
}

function poseFigure(pose: number, known: Uncertainty, isTurnOpen = false): Figure {
  const deg = known.rotation_deg.sigma[0] ?? 0;
  const mm = known.translation_mm.sigma[0] ?? 0;
  return {
    name: words.figures.pose(pose + 1),
    text: isTurnOpen ? words.figures.turnIsOpen(mm) : words.figures.poseIs(deg, mm),
  };
}

export function figuresOf(report: Report): Figure[] {
  const { mesh, poses = [], pose_refinement: refinement } = report;
  const figures: Figure[] = [];
  if (mesh) {
    figures.push({ name: words.figures.surface, text: words.figures.surfaceIs(mesh.area_mm2, mesh.measured_share) });
    if (mesh.volume_mm3) figures.push({ name: words.figures.volume, text: words.figures.volumeIs(mesh.volume_mm3) });
  }
  const residuals = poses.flatMap((pose) => pose.residual_median_mm ?? []);
  if (residuals.length > 0) {
    figures.push({ name: words.figures.views, text: words.figures.viewsAgree(Math.max(...residuals)) });
  }
  if (refinement?.uncertainty) figures.push(poseFigure(1, refinement.uncertainty, refinement.turn_is_open));
  for (const { pose, uncertainty } of refinement?.poses ?? []) {
    figures.push(poseFigure(pose, uncertainty, refinement?.turn_is_open));
  }
  return figures;
}
