#!/usr/bin/env python3
"""What 1, 10 and 1,000 rigs produce in a year: the tables of docs/develop/scale.md, from measured figures.

Usage: scale.py. Prints the tables. The measured figures stand here, each with its place; what is assumed is named.
"""
# A scan of two poses of 8 views at 1280x960, four images a view of 8 bit.
VIEWS, IMAGES_A_VIEW, PIXELS = 16, 4, 1280 * 960
FOLDER_MB = 53          # the rendered figurine's folder on disk, images as PNG (part `scan` of the group `fast`)
CORE_S = 2 * 23         # 23 s on two cores (part `scan`)
MEMORY_GB = 0.65        # peak (part `scan`)
OVERHEAD_S = 1.0        # a job at the cluster (part `slurm`), rounded
MODEL_MB = 157          # the folder of its model; of it model.glb 25, view.glb 4, OBJ 62 with its image, STL 42, PLY 24
GLB_MB = 29             # model.glb and view.glb alone
# Assumed.
SCANS_AN_HOUR, HOURS_A_DAY, DAYS_A_YEAR = 12, 16, 250
CORES_A_NODE, MEMORY_A_NODE_GB = 32, 128
RIGS = (1, 10, 1000)


def row(rigs):
    scans_a_day = rigs * SCANS_AN_HOUR * HOURS_A_DAY
    day_gb = scans_a_day * (FOLDER_MB + MODEL_MB) / 1000
    mean_mb_s = rigs * SCANS_AN_HOUR * (FOLDER_MB + MODEL_MB) / 3600
    busy_cores = rigs * SCANS_AN_HOUR * (CORE_S + 2 * OVERHEAD_S) / 3600
    jobs = busy_cores / 2
    return {
        "rigs": f"{rigs:,}",
        "scans a day": f"{scans_a_day:,}",
        "GB a day": f"{day_gb:,.0f}",
        "TB a year": f"{day_gb * DAYS_A_YEAR / 1000:,.1f}",
        "TB a year, only images and GLB kept": f"{scans_a_day * (FOLDER_MB + GLB_MB) * DAYS_A_YEAR / 1e6:,.1f}",
        "MB/s written, mean of the shift": f"{mean_mb_s:,.1f}",
        "core-hours a day": f"{scans_a_day * CORE_S / 3600:,.0f}",
        "cores busy in the shift": f"{busy_cores:,.1f}",
        "GB of memory at once": f"{jobs * MEMORY_GB:,.1f}",
        f"nodes of {CORES_A_NODE} cores, half loaded": f"{max(1, -(-busy_cores // (CORES_A_NODE / 2))):,.0f}",
        "submissions a second": f"{rigs * SCANS_AN_HOUR / 3600:,.2f}",
    }


def main():
    print(f"Raw images of a scan: {VIEWS * IMAGES_A_VIEW * PIXELS / 1e6:.0f} MB; as PNG {FOLDER_MB} MB; a model {MODEL_MB} MB.")
    rows = [row(rigs) for rigs in RIGS]
    print("\n| | " + " | ".join(f"{one['rigs']} {'rig' if one['rigs'] == '1' else 'rigs'}" for one in rows) + " |")
    print("|---|" + "---|" * len(rows))
    for key in list(rows[0])[1:]:
        print(f"| {key} | " + " | ".join(one[key] for one in rows) + " |")
    year = RIGS[-1] * SCANS_AN_HOUR * HOURS_A_DAY * DAYS_A_YEAR
    print(f"\nAll scans of a year of {RIGS[-1]:,} rigs again: {year * CORE_S / 3600:,.0f} core-hours, "
          f"{year * FOLDER_MB / 1e6:,.0f} TB read.")


if __name__ == "__main__":
    main()
