// Requests to the daemon. Orders carry the header that no other site's page can send.
import type { Problem } from "./types.ts";

export const API = "/api/v1";

/** What the daemon answered instead of obeying. */
export class Refused extends Error {
  constructor(
    readonly status: number,
    message: string,
  ) {
    super(message);
  }
}

async function refusal(response: Response): Promise<Refused> {
  const body: { error?: Problem } = await response.json().catch(() => ({}));
  return new Refused(response.status, body.error?.message ?? `${response.status} ${response.statusText}`);
}

export async function read<T>(path: string, signal?: AbortSignal): Promise<T> {
  const response = await fetch(API + path, { cache: "no-store", ...(signal ? { signal } : {}) });
  if (!response.ok) throw await refusal(response);
  return response.json();
}

export async function order<T = unknown>(
  path: string,
  body: object = {},
  method: "POST" | "DELETE" = "POST",
): Promise<T> {
  const response = await fetch(API + path, {
    method,
    headers: { "X-Scanrig": "1", "Content-Type": "application/json" },
    ...(method === "POST" ? { body: JSON.stringify(body) } : {}),
  });
  if (!response.ok) throw await refusal(response);
  return response.json();
}

export function suggestionOf(job: string, number: number): string {
  return `${API}/jobs/${encodeURIComponent(job)}/suggestions/${number}`;
}

export function fileOf(job: string, path: string): string {
  return `${API}/jobs/${encodeURIComponent(job)}/files/${encodeURIComponent(path)}`;
}
