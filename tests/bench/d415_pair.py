"""The range stage on a real dot pair (Intel D415: a bowl on a flat sheet), beside OpenCV's semi-global matching."""
import json


def measure(bench):
    pair = bench.data / "d415_ir_pair" if bench.data else None
    if pair is None or not pair.is_dir():
        for what in ("D415 sheet, rms of a quadric", "D415 sheet, coverage", "D415 rim, smeared", "D415 rim, bridged"):
            bench.line(what, "-", "not measured: the pair is not here", None)
        return
    done = bench.run([bench.bin / "bench_d415", pair], timeout=300)
    if done.returncode != 0:
        bench.line("D415 pair", "is matched", done.stderr.strip(), False)
        return
    figures = json.loads(done.stdout)
    ours, sgbm = figures["ours"], figures["sgbm"]
    bench.note(f"SGBM: sheet {sgbm['rms_px']} px over {100 * sgbm['coverage']:.1f} %; {figures['rim_rays']} of 120 rays "
               f"from the bowl's centre show the rim in both; ours took {figures['seconds']} s")
    bench.at_most("D415 sheet, rms of a quadric", 0.20, ours["rms_px"], "px")
    bench.at_least("D415 sheet, coverage", 97, 100 * ours["coverage"], "%", digits=1)
    bench.at_most("D415 rim, values between 10 and 90 %, no more than SGBM's", sgbm["rim_smeared_px"],
                  ours["rim_smeared_px"], "px", digits=1)
    bench.at_most("D415 rim, 10 to 90 % with gaps bridged, no wider than SGBM's", sgbm["rim_bridged_px"],
                  ours["rim_bridged_px"], "px", digits=1)
