#!/usr/bin/env python3
"""Loads the API of a daemon until standard input ends, then prints the results as JSON.

Event streams, requests at a steady rate over kept connections, and slow-loris clients, over TCP and the Unix socket.
Every request has a scheduled time. A late request counts from its scheduled time, so the waiting does not hide a stall.
"""
import argparse
import asyncio
import json
import sys
import time

REQUESTERS = 20
LORIS_PAUSE_S = 0.5
PATIENCE_S = 15
OTHERS = ("/api/v1/jobs?limit=20", "/api/v1/health", "/api/v1/io", "/metrics")  # one in five requests is one of these


class Load:
    def __init__(self, options):
        self.o = options
        self.status_ms, self.others_ms, self.failed = [], [], []
        self.events = self.streams_lost = self.loris_cut = 0
        self.ended = asyncio.Event()

    async def connect(self, number):
        """Every second client comes over TCP."""
        if number % 2 and self.o.port:
            return await asyncio.open_connection("127.0.0.1", self.o.port)
        return await asyncio.open_unix_connection(self.o.socket)

    def request(self, target):
        return (f"GET {target} HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {self.o.token}\r\n\r\n").encode()

    async def ask(self, reader, writer, target):
        writer.write(self.request(target))
        head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), PATIENCE_S)
        length = int(head.lower().split(b"content-length: ")[1].split(b"\r\n")[0])
        await asyncio.wait_for(reader.readexactly(length), PATIENCE_S)
        return int(head[9:12])

    async def requester(self, number):
        period = REQUESTERS / self.o.rate
        due = time.monotonic() + period * number / REQUESTERS
        reader, writer = await self.connect(number)
        count = number
        while not self.ended.is_set():
            await asyncio.sleep(max(0.0, due - time.monotonic()))
            target = OTHERS[count // 5 % len(OTHERS)] if count % 5 == 0 else "/api/v1/status"
            try:
                status = await self.ask(reader, writer, target)
                late = (time.monotonic() - due) * 1000
                (self.status_ms if target.endswith("status") else self.others_ms).append(late)
                if status != 200:
                    self.failed.append(f"{target}: {status}")
            except (OSError, asyncio.IncompleteReadError, asyncio.TimeoutError) as error:
                self.failed.append(f"{target}: {type(error).__name__}")
                reader, writer = await self.connect(number)
            count += 1
            due += period
        writer.close()

    async def stream(self, number):
        reader, writer = await self.connect(number)
        writer.write(self.request("/api/v1/events"))
        while not self.ended.is_set():
            line = await reader.readline()
            if not line:
                self.streams_lost += not self.ended.is_set()
                break
            self.events += line.startswith(b"event:")
        writer.close()

    async def loris(self, number):
        """A byte now and then of a header that never ends; comes back when it is cut off."""
        while not self.ended.is_set():
            reader, writer = await self.connect(number)
            try:
                writer.write(b"GET /api/v1/status HTTP/1.1\r\nX-Slow: ")
                cut_off = asyncio.ensure_future(reader.read(1))
                while not self.ended.is_set() and not cut_off.done():
                    writer.write(b"x")
                    await asyncio.wait({cut_off}, timeout=LORIS_PAUSE_S)
                cut_off.cancel()
            except OSError:
                pass
            self.loris_cut += not self.ended.is_set()
            writer.close()

    async def run(self):
        work = [self.stream(n) for n in range(self.o.streams)] + [self.loris(n) for n in range(self.o.loris)]
        tasks = [asyncio.ensure_future(one) for one in work + [self.requester(n) for n in range(REQUESTERS)]]
        await asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
        self.ended.set()
        await asyncio.sleep(2 * LORIS_PAUSE_S)
        for task in tasks:
            task.cancel()
        results = await asyncio.gather(*tasks, return_exceptions=True)
        broken = [repr(r) for r in results if isinstance(r, Exception)]
        return {"status_ms": self.status_ms, "others_ms": self.others_ms, "failed": self.failed + broken,
                "events": self.events, "streams_lost": self.streams_lost, "loris_cut": self.loris_cut}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--socket", required=True)
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--token", required=True)
    parser.add_argument("--rate", type=float, default=200, help="requests a second, all together")
    parser.add_argument("--streams", type=int, default=50)
    parser.add_argument("--loris", type=int, default=20)
    json.dump(asyncio.run(Load(parser.parse_args()).run()), sys.stdout)


if __name__ == "__main__":
    main()
