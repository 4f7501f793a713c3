import type { FileList } from "../api/types.ts";

/** The file that is quickest to show: the reduced model where there is one. */
export function modelFile(list: FileList): string | undefined {
  const models = list.files.filter((file) => file.path.endsWith(".glb"));
  return (models.find((file) => file.path.endsWith("view.glb")) ?? models[0])?.path;
}
