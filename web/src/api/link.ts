// The state of the connection, apart from sockets and clocks: what was heard when, and what follows from it.

export const SILENCE_MS = 900; // without an event for so long, what the page shows is old
export const DEAF_MS = 400; // a tap on what has just appeared is no decision
const RETRY_MS = [250, 500, 1000, 2000];

export interface Link {
  heard: number; // when the last event came, in ms
  connected: boolean;
  failures: number; // in a row
  changed: number; // when what may be pressed last changed
}

export const newLink = (now: number): Link => ({ heard: now, connected: false, failures: 0, changed: now });

export const opened = (link: Link, now: number): Link => ({
  ...link,
  heard: now,
  connected: true,
  failures: 0,
  changed: now,
});

export const heard = (link: Link, now: number): Link => ({ ...link, heard: now });

export const broken = (link: Link): Link => ({ ...link, connected: false, failures: link.failures + 1 });

export const retryAfter = (link: Link): number =>
  RETRY_MS[Math.min(Math.max(link.failures, 1), RETRY_MS.length) - 1] ?? 2000;

/** Whether the page must be drawn as old. */
export const isOld = (link: Link, now: number): boolean => !link.connected || now - link.heard > SILENCE_MS;

export const isDeaf = (link: Link, now: number): boolean => now - link.changed < DEAF_MS;

/** What a Start would do, as the daemon last said; a change of it makes the page deaf for a moment. */
export const noteChange = (link: Link, before: string, after: string, now: number): Link =>
  before === after ? link : { ...link, changed: now };
