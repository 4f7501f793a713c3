#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/context.h"
#include "core/result.h"

namespace scanrig {

struct MeshImportOptions {
  double unit_mm = 0.0;  ///< length of the files' unit; 0: metres for range grids, millimetres for meshes
};

/// What became of the files.
struct MeshImport {
  struct Used {
    std::filesystem::path file;
    int view = 0;  ///< its index in the scan folder
  };
  struct LeftOut {
    std::filesystem::path file;
    std::string sentence;  ///< for the person at the terminal; names the file
  };
  std::vector<Used> used;
  std::vector<LeftOut> left_out;
  double median_mm = 0.0;  ///< distance between surfaces that two views see
};

/// Makes a scan folder of source `range` and one pose from partial scans of one object in unknown positions, one file
/// each: range grids or meshes, read_view() of mesh_view.h. place_views() of pipeline/pose finds where they lie;
/// whatever the files say about that is not used. Scans that do not fit the others are left out.
/// The pose's frame has the axes of the first scan that is used, its origin under the middle of the measured surface;
/// y = 0 is the 0.1th percentile of its heights. Table angles are 0: there is no table. `import.json` in the folder
/// says which file became which view, and what was left out. Same bits for any number of threads. Nothing is written
/// before all is found, and the folder appears as a whole. Fails with `exists`, `not_found`, `io`, `unsupported`,
/// `invalid_input` (fewer than two files or more than kMaxUnknownViews, a file that shows no surface), `no_overlap` (no
/// two scans fit together), `stopped`.
Result<MeshImport> import_meshes(std::span<const std::filesystem::path> files, const std::filesystem::path& out_folder,
                                 const MeshImportOptions& options, const Context& context);

}  // namespace scanrig
