"""Part `scaling` of the group `fast`: seconds of a reconstruction over views, pixels, voxels and threads, without
texture, whose work is the atlas. Scans of one pose, so that no search for the other one is in the way."""
import fast_runs
import fit

MEGAPIXELS = 1.2288
WITHIN = 15  # percent of the line
VIEWS, LONG_VIEWS = (4, 8, 16), (4, 8, 16, 32, 64)
SCALES, LONG_SCALES = (0.5, 0.7, 1.0), (0.5, 0.7, 1.0, 1.4, 2.0)
VIEWS_OF_A_SIZE = 8
USUAL_VOXEL_MM = "0.25"
VOXELS_MM = ("0.5", "0.35", USUAL_VOXEL_MM, "0.2")


class Medians:
    """Reconstructions of one kind: medians of their times."""

    def __init__(self, bench, scan, model, *options):
        runs = [fast_runs.Timed(bench, scan, model, "--no-texture", *options) for _ in range(bench.pick(5, 3, 1))]
        self.seconds = fast_runs.median_of(runs, lambda run: run.seconds)
        self.processor = fast_runs.median_of(runs, lambda run: run.processor_seconds)
        self.spread = (max(run.seconds for run in runs) - min(run.seconds for run in runs)) / self.seconds
        self.integration = fast_runs.median_of(runs, lambda run: run.stages["integration"])
        self.voxels = runs[0].voxels


def words_of(line, unit):
    return f"{line.fixed:.2f} s + {line.slope:.2f} s a {unit}"


def report(bench, what, unit, runs, asked):
    """`runs`: pairs of an amount and its Medians. `asked`: whether a limit holds for the deviation of wall time."""
    wall = fit.through([(x, run.seconds) for x, run in runs])
    processor = fit.through([(x, run.processor) for x, run in runs])
    steps = ", ".join(f"{x:g}: {run.seconds:.1f}" for x, run in runs)
    last = f"{runs[-1][1].seconds:.1f} s for {runs[-1][0]:g}"
    bench.line(f"{what}: seconds", "reported", f"{last}; {words_of(wall, unit)} ({steps})", True)
    name = f"{what}: largest deviation from the line"
    if asked:
        bench.at_most(name, WITHIN, 100 * wall.worst, "%", digits=1)
    else:
        bench.line(name, "reported", f"{100 * wall.worst:.1f} %", True)
    bench.line(f"{what}: seconds of the processor", "reported",
               f"{runs[-1][1].processor:.1f} s; {words_of(processor, unit)}; deviation {100 * processor.worst:.1f} %", True)
    bench.note(f"repetitions of one kind differ by up to {100 * max(run.spread for _, run in runs):.0f} %")


def over_views(bench, scratch, ring, counts):
    runs = []
    for count in counts:
        scan = fast_runs.thinned(ring, scratch / f"views-{count}", count)
        runs.append((count, Medians(bench, scan, scratch / "model")))
    report(bench, "views", "view", runs, asked=True)
    return dict(runs)


def over_pixels(bench, scratch, whole):
    """`whole`: of full scale."""
    runs = []
    for scale in bench.pick(LONG_SCALES, SCALES, SCALES[:2]):
        run = whole
        if scale != 1.0:
            scan = fast_runs.shoot(bench, f"fast-scale-{scale}", "--poses", "1", "--views", str(VIEWS_OF_A_SIZE), "--scale",
                                   str(scale))
            run = Medians(bench, scan, scratch / "model")
        runs.append((round(VIEWS_OF_A_SIZE * MEGAPIXELS * scale ** 2, 2), run))
    report(bench, f"pixels of {VIEWS_OF_A_SIZE} views, MP", "MP", runs, asked=True)


def over_voxels(bench, scratch, scan, usual):
    runs = []
    for voxel_mm in VOXELS_MM:
        run = usual if voxel_mm == USUAL_VOXEL_MM else Medians(bench, scan, scratch / "model", "--voxel-mm", voxel_mm)
        bench.line(f"voxels of {voxel_mm} mm: integration", "reported",
                   f"{run.integration:.2f} s; {run.voxels / 1e6:.2f} million voxels", True)
        runs.append((round(run.voxels / 1e6, 2), run))
    report(bench, "voxels, million", "million", runs, asked=False)


def over_threads(bench, scratch, scan, usual):
    one = Medians(bench, scan, scratch / "model", "--threads", "1")
    two = usual if bench.cores == 2 else Medians(bench, scan, scratch / "model", "--threads", "2")
    bench.line(f"{VIEWS_OF_A_SIZE} views with 1 and 2 threads", "reported",
               f"{one.seconds:.1f}, {two.seconds:.1f} s: {one.seconds / two.seconds:.2f} times as fast", True)


def measure(bench, scratch):
    counts = bench.pick(LONG_VIEWS, VIEWS, VIEWS[:2])
    ring = fast_runs.shoot(bench, f"fast-ring-{counts[-1]}", "--poses", "1", "--views", str(counts[-1]))
    by_views = over_views(bench, scratch, ring, counts)
    usual, scan = by_views[VIEWS_OF_A_SIZE], scratch / f"views-{VIEWS_OF_A_SIZE}"
    over_pixels(bench, scratch, usual)
    over_voxels(bench, scratch, scan, usual)
    over_threads(bench, scratch, scan, usual)
