#include "pipeline/importers/import_meshes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "core/units.h"
#include "pipeline/importers/mesh_view.h"
#include "tests/unit/pipeline/registration/analytic_views.h"
#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

using namespace scan_samples;
using ::testing::HasSubstr;
using ::testing::SizeIs;

const testing::RigModel kMeshRig{.width = 224, .height = 168, .focal_px = 800};

testing::Solid lumps() {
  using namespace testing;
  return together({ball({0, 30, 0}, 24), ball({20, 48, 6}, 11), ball({-12, 52, 14}, 9), ball({4, 36, -24}, 8),
                   ball({-22, 22, -8}, 10), block({-16, 0, -14}, {18, 12, 16}), block({10, 8, 10}, {30, 20, 22})});
}

Transform somewhere(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Eigen::Vector4d q;
  for (double& value : q) value = normal(random);
  Transform t = Transform::Identity();
  t.linear() = Eigen::Quaterniond(q.normalized()).toRotationMatrix();
  for (double& value : t.translation()) value = 150.0 * normal(random);
  return t;
}

/// How a view is written.
struct Style {
  bool faces = true;
  bool normals = false;
  bool inside_out = false;  ///< faces clockwise seen from outside
  double unit_mm = 1.0;
};

/// The measured pixels as a PLY mesh; no face spans a depth step. File frame: `file_from_model`.
std::string mesh_text(const RangeImage& image, const Transform& file_from_model, const Style& style) {
  const Transform file_from_camera = file_from_model * image.camera_from_pose.inverse();
  cv::Mat1i index(image.depth.size(), -1);
  std::string points, faces;
  int count = 0, face_count = 0;
  for (int r = 0; r < image.depth.rows; ++r) {
    for (int c = 0; c < image.depth.cols; ++c) {
      if (std::isnan(image.depth(r, c))) continue;
      const Eigen::Vector3d p = file_from_camera * image.projection.unproject(c, r, image.depth(r, c)) / style.unit_mm;
      const cv::Vec3f& m = image.normal(r, c);
      const Eigen::Vector3d n = file_from_camera.linear() * Eigen::Vector3d(m[0], m[1], m[2]);
      points += fmt::format("{:.6f} {:.6f} {:.6f}", p.x(), p.y(), p.z());
      points += style.normals ? fmt::format(" {:.4f} {:.4f} {:.4f}\n", n.x(), n.y(), n.z()) : "\n";
      index(r, c) = count++;
    }
  }
  for (int r = 0; r + 1 < image.depth.rows && style.faces; ++r) {
    for (int c = 0; c + 1 < image.depth.cols; ++c) {
      const int a = index(r, c), b = index(r, c + 1), d = index(r + 1, c), e = index(r + 1, c + 1);
      if (std::min({a, b, d, e}) < 0) continue;
      const auto [low, high] =
          std::minmax({image.depth(r, c), image.depth(r, c + 1), image.depth(r + 1, c), image.depth(r + 1, c + 1)});
      if (high - low > 3.0F) continue;
      faces +=
          style.inside_out ? fmt::format("4 {} {} {} {}\n", a, b, e, d) : fmt::format("4 {} {} {} {}\n", a, d, e, b);
      ++face_count;
    }
  }
  std::string header = fmt::format(
      "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
      "property float z\n",
      count);
  if (style.normals) header += "property float nx\nproperty float ny\nproperty float nz\n";
  if (style.faces) header += fmt::format("element face {}\nproperty list uchar int vertex_indices\n", face_count);
  return header + "end_header\n" + points + faces;
}

class ImportMeshes : public FolderTest {
 protected:
  std::filesystem::path write_view(const std::string& name, const testing::Solid& solid, double turn_deg,
                                   const Style& style = {}, double elevation_deg = 22.0) {
    testing::RigModel rig = kMeshRig;
    rig.elevation_deg = elevation_deg;
    const RangeImage image =
        testing::see(solid, testing::camera_from_turntable(rig) * rot_y(to_radians(turn_deg)), rig, 1);
    file_from_model_.push_back(somewhere(random_));
    write_text(folder_ / name, mesh_text(image, file_from_model_.back(), style));
    files_.push_back(folder_ / name);
    return files_.back();
  }
  void write_figure(const Style& style = {}) {
    for (const double turn : {0.0, 35.0, 70.0, 105.0})
      write_view(fmt::format("turn_{}.ply", turn), lumps(), turn, style);
    write_view("above.ply", lumps(), 20.0, style, 60.0);
  }
  Result<MeshImport> import(const MeshImportOptions& options = {}) {
    return import_meshes(files_, folder_ / "out", options, {});
  }
  void expect_refused(ErrorCode code, const std::string& words) {
    const auto imported = import();
    ASSERT_FALSE(imported);
    EXPECT_EQ(imported.error().code, code) << imported.error().message;
    EXPECT_THAT(imported.error().message, HasSubstr(words));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out.new"));
  }
  /// Every used file's place in the scan's pose, against the first one's.
  void expect_in_place(const MeshImport& import, double unit_mm, double max_deg, double max_mm) {
    const auto scan = ScanFolder::open(folder_ / "out");
    ASSERT_TRUE(scan) << scan.error().message;
    const auto& views = scan->manifest().poses.at(0).views;
    ASSERT_EQ(views.size(), import.used.size());
    std::vector<Transform> pose_from_model;
    for (const auto& used : import.used) {
      const auto file = std::ranges::find(files_, used.file) - files_.begin();
      const Transform camera_from_scan = read_view(used.file, unit_mm).value().camera_from_scan;
      pose_from_model.push_back(views.at(used.view).camera_from_pose.inverse() * camera_from_scan *
                                file_from_model_[file]);
    }
    const Eigen::Vector3d middle(0, 30, 0);
    for (const Transform& t : pose_from_model) {
      const Transform error = pose_from_model.front().inverse() * t;
      EXPECT_LT(to_degrees(rotation_angle(error.linear())), max_deg);
      EXPECT_LT((error * middle - middle).norm(), max_mm);
    }
  }

  std::mt19937 random_{11};
  std::vector<std::filesystem::path> files_;
  std::vector<Transform> file_from_model_;  ///< of each of them
};

TEST_F(ImportMeshes, JoinsScansWhosePlacesAreUnknownAndNamesTheOneOfAnotherObject) {
  write_figure();
  write_view("other.ply", testing::workpiece(), 60.0);
  const auto imported = import();
  ASSERT_TRUE(imported) << imported.error().message;
  EXPECT_THAT(imported->used, SizeIs(5));
  ASSERT_THAT(imported->left_out, SizeIs(1));
  EXPECT_EQ(imported->left_out[0].file, files_[5]);
  EXPECT_THAT(imported->left_out[0].sentence, HasSubstr("other.ply is not used"));
  expect_in_place(*imported, 0.0, 0.3, 0.3);
  const auto record = nlohmann::json::parse(read_file(folder_ / "out/import.json").value());
  EXPECT_EQ(record.at("views").size(), 5U);
  EXPECT_EQ(record.at("left_out").at(0).at("file"), files_[5].string());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out.new"));
}

TEST_F(ImportMeshes, TheLowestPointsLieOnTheTable) {
  write_figure();
  ASSERT_TRUE(import());
  const auto scan = ScanFolder::open(folder_ / "out").value();
  EXPECT_EQ(scan.manifest().state, "scanned");
  EXPECT_EQ(scan.manifest().source, "range");
  std::vector<double> heights;
  for (std::size_t v = 0; v < scan.manifest().poses[0].views.size(); ++v) {
    EXPECT_EQ(scan.manifest().poses[0].views[v].measured_deg, 0.0);
    const RangeImage range = scan.load_range(0, v).value();
    for (int r = 0; r < range.depth.rows; ++r) {
      for (int c = 0; c < range.depth.cols; ++c) {
        if (std::isnan(range.depth(r, c))) continue;
        heights.push_back((range.camera_from_pose.inverse() * range.projection.unproject(c, r, range.depth(r, c))).y());
      }
    }
  }
  const auto below = std::ranges::count_if(heights, [](double height) { return height < 0.0; });
  EXPECT_NEAR(static_cast<double>(below) / static_cast<double>(heights.size()), 0.001, 0.0009);
}

// The files' own frames must leave no trace, or a scan would be placed by what no scanner measured.
TEST_F(ImportMeshes, WhereAFilePutsItsScanMakesNoDifference) {
  write_figure();
  const auto first = import();
  ASSERT_TRUE(first) << first.error().message;
  files_.clear();
  file_from_model_.clear();
  std::filesystem::rename(folder_ / "out", folder_ / "before");
  write_figure();  // elsewhere: the random places go on
  const auto second = import();
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_THAT(second->used, SizeIs(5));
  expect_in_place(*second, 0.0, 0.3, 0.3);
}

TEST_F(ImportMeshes, VertexNormalsSayWhichSideIsOutside) {
  write_view("a.ply", lumps(), 0.0, {.normals = true, .inside_out = true});
  write_view("b.ply", lumps(), 30.0, {.normals = true, .inside_out = true});
  write_view("c.ply", lumps(), 60.0, {.normals = true});
  const auto imported = import();
  ASSERT_TRUE(imported) << imported.error().message;
  EXPECT_THAT(imported->used, SizeIs(3));
  expect_in_place(*imported, 0.0, 0.3, 0.3);
}

TEST_F(ImportMeshes, LengthsAreInTheUnitThatIsNamed) {
  for (const double turn : {0.0, 30.0}) write_view(fmt::format("{}.ply", turn), lumps(), turn, {.unit_mm = 25.4});
  const auto imported = import({.unit_mm = 25.4});
  ASSERT_TRUE(imported) << imported.error().message;
  expect_in_place(*imported, 25.4, 0.3, 0.3);
}

TEST_F(ImportMeshes, RefusesOneScanAlone) {
  write_view("alone.ply", lumps(), 0.0);
  expect_refused(ErrorCode::invalid_input, "2 to 100 can be joined");
}

TEST_F(ImportMeshes, RefusesScansWithoutCommonSurface) {
  write_view("one.ply", lumps(), 0.0);
  write_view("two.ply", testing::workpiece(), 0.0);
  expect_refused(ErrorCode::no_overlap, "no two of the 2 scans fit together");
}

TEST_F(ImportMeshes, RefusesPointsWithoutFaces) {
  write_view("good.ply", lumps(), 0.0);
  write_view("points.ply", lumps(), 30.0, {.faces = false});
  expect_refused(ErrorCode::invalid_input, "points.ply: no faces");
}

TEST_F(ImportMeshes, RefusesFilesThatAreNoMesh) {
  write_view("good.ply", lumps(), 0.0);
  files_.push_back(folder_ / "absent.ply");
  expect_refused(ErrorCode::not_found, "absent.ply");
  files_.back() = folder_ / "letter.ply";
  write_text(files_.back(), "Dear Sir or Madam\n");
  expect_refused(ErrorCode::invalid_input, "letter.ply: not a PLY file");
  files_.back() = folder_ / "letter.txt";
  write_text(files_.back(), "Dear Sir or Madam\n");
  expect_refused(ErrorCode::invalid_input, "letter.txt: neither .stl, .ply, .obj nor .glb");
  files_.back() = folder_ / "torn.ply";
  const std::string whole = read_file(files_.front()).value();
  write_text(files_.back(), whole.substr(0, whole.size() / 2));
  expect_refused(ErrorCode::invalid_input, "torn.ply");
}

TEST_F(ImportMeshes, RefusesMeshesThatAreNoView) {
  write_view("good.ply", lumps(), 0.0);
  files_.push_back(folder_ / "flat.ply");
  write_text(files_.back(),
             "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
             "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n");
  expect_refused(ErrorCode::invalid_input, "flat.ply: no face has an area");
  files_.back() = folder_ / "whole.obj";
  write_text(files_.back(), "v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
  expect_refused(ErrorCode::invalid_input, "whole.obj: the faces look to all sides");
  files_.back() = folder_ / "tiny.obj";
  write_text(files_.back(), "v 0 0 0\nv 9 0 0\nv 0 0.1 0\nf 1 2 3\n");
  expect_refused(ErrorCode::invalid_input, "tiny.obj: shows only");
}

TEST_F(ImportMeshes, AnExistingFolderIsNotTouched) {
  write_figure();
  std::filesystem::create_directories(folder_ / "out" / "precious");
  EXPECT_EQ(import().error().code, ErrorCode::exists);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out" / "precious"));
}

TEST_F(ImportMeshes, StopsOnRequest) {
  write_figure();
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(import_meshes(files_, folder_ / "out", {}, {stop.get_token(), {}}).error().code, ErrorCode::stopped);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

}  // namespace
}  // namespace scanrig
