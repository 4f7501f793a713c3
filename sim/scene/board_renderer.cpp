#include "sim/scene/board_renderer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "sim/scene/profile.h"
#include "sim/scene/random.h"
#include "sim/scene/surface_colour.h"

namespace scanrig::sim {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

constexpr int kGridX = 13, kGridY = 10;  // nodes of the light over the print
constexpr double kBoxSigma = 0.288675;   // of a box one wide

/// Where a ray enters a box. `distance` in lengths of the ray's direction.
struct Entry {
  double distance = -1.0;  ///< below 0: missed
  int axis = 0;
  double side = 1.0;  ///< -1: the face at -half
};

Entry enter_box(const Vector3d& from, const Vector3d& way, const Vector3d& half) {
  Entry in;
  double near = 0.0, far = 1e9;
  for (int i = 0; i < 3; ++i) {
    const double to_low = (-half[i] - from[i]) / way[i], to_high = (half[i] - from[i]) / way[i];
    const double enter = std::min(to_low, to_high), leave = std::max(to_low, to_high);
    if (enter > near) near = enter, in.axis = i, in.side = to_low < to_high ? -1.0 : 1.0;
    far = std::min(far, leave);
  }
  if (near > 0.0 && near <= far) in.distance = near;
  return in;
}

/// Mixes what the light gives at the four corners of a face.
Surroundings mixed(const Surroundings& a, const Surroundings& b, const Surroundings& c, const Surroundings& d, double u,
                   double v) {
  const auto x = static_cast<float>(u), y = static_cast<float>(v);
  const float wa = (1.0F - x) * (1.0F - y), wb = x * (1.0F - y), wc = (1.0F - x) * y, wd = x * y;
  return {wa * a.ambient + wb * b.ambient + wc * c.ambient + wd * d.ambient,
          wa * a.openness + wb * b.openness + wc * c.openness + wd * d.openness};
}

}  // namespace

/// One image of one scene.
class BoardShot {
 public:
  struct Sample {
    Vector3f light = Vector3f::Zero();
    int surface = -2;   // -2 backdrop, -1 table, else box and face
    bool even = false;  // only from probe(): nothing else within more than the pixel
  };

  BoardShot(const BoardScene& scene, const Eye& camera, const RayMap& rays, double angle)
      : scene_(scene), camera_(camera), rays_(rays), turntable_from_table_(rot_y(angle)) {
    const Transform table_from_eye = turntable_from_table_.inverse() * camera.eye_from_turntable.inverse();
    table_from_eye_ = table_from_eye.linear();
    eye_ = table_from_eye.translation();
    focus_ = (camera.eye_from_turntable * Vector3d(0.0, profile().aim_height_mm, 0.0)).z() + camera.focus_off_mm;
    for (const auto& box : scene.boxes_) {
      const Transform box_from_table = box.table_from_box.inverse();
      boxes_.push_back({box_from_table * eye_, box_from_table.linear() * table_from_eye_});
    }
  }

  /// The middle of a pixel, and whether all of the pixel shows the same.
  [[nodiscard]] Sample probe(double u, double v) const {
    constexpr double kWidth = 1.2, kClear = 1.0;  // px, mm
    Sample s = sample(u, v, kWidth);
    const Vector3d in_eye = rays_.ray(u, v);
    const std::size_t seen = s.surface == 0 ? 0 : boxes_.size();
    for (std::size_t i = 0; i < boxes_.size() && s.even; ++i) {
      const Vector3d half = scene_.boxes_[i].half.array() + kClear;
      s.even = i == seen || enter_box(boxes_[i].eye, boxes_[i].from_eye * in_eye, half).distance < 0.0;
    }
    return s;
  }

  /// `width`: of the sample, in pixels.
  [[nodiscard]] Sample sample(double u, double v, double width) const {
    const Vector3d in_eye = rays_.ray(u, v);
    const Vector3d way = table_from_eye_ * in_eye;
    if ((scene_.middle_ - eye_).cross(way).squaredNorm() < scene_.radius_ * scene_.radius_ * way.squaredNorm()) {
      Entry first;
      int which = -1;
      for (std::size_t i = 0; i < boxes_.size(); ++i) {
        const Entry in = enter_box(boxes_[i].eye, boxes_[i].from_eye * in_eye, scene_.boxes_[i].half);
        if (in.distance > 0.0 && (which < 0 || in.distance < first.distance)) first = in, which = static_cast<int>(i);
      }
      if (which == 0 && first.axis == 2 && first.side < 0.0) return print_sample(in_eye, first.distance, width);
      if (which >= 0) return face_sample(which, first, in_eye);
    }
    const double to_table = -eye_.y() / way.y();
    const Vector3d on_table = eye_ + to_table * way;
    const double from_axis = std::hypot(on_table.x(), on_table.z());
    if (to_table > 0.0 && from_axis < profile().table_radius_mm) return table_sample(on_table, to_table, width);
    const bool even = to_table < 0.0 || from_axis > profile().table_radius_mm + kRimClear;
    const Vector3d eye = turntable_from_table_ * eye_, turned = turntable_from_table_ * way;
    return {backdrop_.plain_light(eye + backdrop_.distance(eye, turned) * turned), -2, even};
  }

 private:
  static constexpr double kRimClear = 2.0;  // mm on the table: more than a pixel, however flat the view

  struct InBox {
    Vector3d eye;
    Eigen::Matrix3d from_eye;
  };

  /// Sigma of the averaging over one sample, in pixels: its width and the defocus at `depth`.
  [[nodiscard]] double averaging(double depth, double width) const {
    const Profile& p = profile();
    return std::hypot(kBoxSigma * width, p.defocus_px_per_mm * std::abs(depth - focus_) * camera_.fx / p.focal_px);
  }

  [[nodiscard]] Sample print_sample(const Vector3d& in_eye, double distance, double width) const {
    const PrintedBoard& board = scene_.board_;
    const double to_print = -0.5 * board.layout().thickness_mm;  // z of the flat print in the box's frame
    const Vector3d& eye = boxes_[0].eye;
    const Eigen::Matrix3d& from_eye = boxes_[0].from_eye;
    const Vector3d way = from_eye * in_eye;
    Vector3d at = eye + distance * way;
    for (int i = 0; i < 3; ++i) {
      distance += (to_print + board.warp(at.x(), at.y()) - at.z()) / way.z();
      at = eye + distance * way;
    }
    // How far the point moves on the print per pixel.
    const auto per_pixel = [&](int axis, double focal) {
      const Vector3d turn = from_eye.col(axis) / focal;
      return Vector2d(distance * (turn - way * (turn.z() / way.z())).head<2>());
    };
    const Vector2d along_u = per_pixel(0, camera_.fx), along_v = per_pixel(1, camera_.fy);
    const double pixels = averaging(distance * in_eye.z(), width);
    const Vector2d sigma = pixels * (along_u.cwiseAbs2() + along_v.cwiseAbs2()).cwiseSqrt();
    const PrintedBoard::Print print = board.print(at.head<2>(), sigma);

    const Transform& table_from_box = scene_.boxes_[0].table_from_box;
    const Vector3d normal = turntable_from_table_.linear() * -table_from_box.linear().col(2);
    const BoardLayout& layout = board.layout();
    const double x = std::clamp(at.x() / layout.width() + 0.5, 0.0, 0.9999) * (kGridX - 1);
    const double y = std::clamp(at.y() / layout.height() + 0.5, 0.0, 0.9999) * (kGridY - 1);
    const int node = static_cast<int>(y) * kGridX + static_cast<int>(x);
    const auto light = [&](int vertex) { return scene_.light_->at_vertex(vertex); };
    const Surroundings around = mixed(light(node), light(node + 1), light(node + kGridX), light(node + kGridX + 1),
                                      x - std::floor(x), y - std::floor(y));
    const Vector2d inside(0.5 * layout.width() - std::abs(at.x()), 0.5 * layout.height() - std::abs(at.y()));
    const bool even = print.even && (inside.array() > 4.0 * sigma.array()).all();
    Sample s{print.albedo.cwiseProduct(RoomLight::irradiance(around, normal)), 0, even};
    if (board.errors().glare > 0.0) {
      const Vector3d to_eye = -(turntable_from_table_.linear() * (table_from_eye_ * in_eye)).normalized();
      s.light += Vector3f::Constant(static_cast<float>(board.errors().glare) * mirrored(normal, to_eye));
    }
    return s;
  }

  /// Light of the soft boxes from a half-glossy surface.
  static float mirrored(const Vector3d& normal, const Vector3d& to_eye) {
    constexpr double kGloss = 1.0, kWidth = 0.01;
    double light = 0.0;
    for (const auto& box : RoomLight::soft_boxes()) {
      const double off = 1.0 - normal.dot((to_eye + box.towards).normalized());
      light += box.share * kGloss * std::exp(-off / kWidth);
    }
    return static_cast<float>(light);
  }

  [[nodiscard]] Sample face_sample(int which, const Entry& in, const Vector3d& in_eye) const {
    const BoardScene::Box& box = scene_.boxes_[which];
    const Vector3d at = boxes_[which].eye + in.distance * (boxes_[which].from_eye * in_eye);
    const int other = (in.axis + 1) % 3, third = (in.axis + 2) % 3, face = 2 * in.axis + (in.side > 0.0 ? 1 : 0);
    const int vertex = box.first_vertex + 4 * face;
    const auto light = [&](int i) { return scene_.light_->at_vertex(vertex + i); };
    const auto along = [&](int axis) { return std::clamp(0.5 * at[axis] / box.half[axis] + 0.5, 0.0, 1.0); };
    const Surroundings around = mixed(light(0), light(1), light(2), light(3), along(other), along(third));
    const Vector3d normal = turntable_from_table_.linear() * (in.side * box.table_from_box.linear().col(in.axis));
    return {box.albedo.cwiseProduct(RoomLight::irradiance(around, normal)), 8 * which + face + 1, false};
  }

  [[nodiscard]] Sample table_sample(const Vector3d& in_table, double depth, double width) const {
    const Profile& p = profile();
    const double size = averaging(depth, width) / kBoxSigma * depth / camera_.fx / std::sqrt(0.4);
    const auto dot = static_cast<float>(rim_dot_share(in_table, size, scene_.rim_dots_));
    const Vector3f albedo = (1.0F - dot) * rgb(p.table_albedo) + dot * rgb(p.rim_dot_albedo);
    const Surroundings around = scene_.light_->on_table(in_table.x(), in_table.z());
    const double from_axis = std::hypot(in_table.x(), in_table.z());
    const bool even = from_axis < p.rim_dot_radius_mm - p.rim_dot_diameter_mm - kRimClear;
    return {albedo.cwiseProduct(RoomLight::irradiance(around, Vector3d::UnitY())), -1, even};
  }

  const BoardScene& scene_;
  const Eye& camera_;
  const RayMap& rays_;
  const Backdrop backdrop_;
  Transform turntable_from_table_;
  Eigen::Matrix3d table_from_eye_;
  Vector3d eye_;  // in the table's frame
  double focus_ = 0.0;
  std::vector<InBox> boxes_;
};

namespace {

Vector3f render_pixel(const BoardShot& shot, int x, int y, std::uint64_t bits) {
  const BoardShot::Sample probe = shot.probe(x, y);
  if (probe.even) return probe.light;
  const double turn = 0.5 * std::numbers::pi * uniform(bits);
  constexpr double kArm = 0.35355;  // half the diagonal of a half-pixel square
  const double c = kArm * std::cos(turn), s = kArm * std::sin(turn);
  const std::array<Vector2d, 4> arms = {{{c, s}, {-s, c}, {-c, -s}, {s, -c}}};
  Vector3f sum = Vector3f::Zero();
  bool one_surface = true;
  int surface = 0;
  for (int i = 0; i < 4; ++i) {
    const BoardShot::Sample sample = shot.sample(x + arms[i].x(), y + arms[i].y(), 0.5);
    if (i == 0) surface = sample.surface;
    one_surface = one_surface && sample.surface == surface;
    sum += 0.25F * sample.light;
  }
  if (one_surface) return sum;
  sum.setZero();
  for (int i = 0; i < 16; ++i) {
    bits = mix(bits);
    const int column = i % 4, row = i / 4;
    const double u = (column + uniform(bits)) / 4.0 - 0.5, v = (row + uniform(mix(bits + 1))) / 4.0 - 0.5;
    sum += shot.sample(x + u, y + v, 0.25).light / 16.0F;
  }
  return sum;
}

}  // namespace

BoardScene::BoardScene(const PrintedBoard& board, PlacedBoard placed, const RimDotErrors& rim_dots)
    : board_(board), placed_(std::move(placed)), rim_dots_(rim_dots) {
  const BoardLayout& layout = board.layout();
  Object mesh;
  mesh.name = "board";
  add_print(mesh);
  const Vector3d half(0.5 * layout.width(), 0.5 * layout.height(), 0.5 * layout.thickness_mm);
  const Transform table_from_box = placed_.table_from_board * Eigen::Translation3d(0.0, 0.0, half.z());
  boxes_.push_back({table_from_box, half, Vector3f(0.55F, 0.55F, 0.56F), add_box(mesh, table_from_box, half, true)});
  for (const Block& block : placed_.blocks) {
    const Vector3f albedo = block.albedo * Vector3f(1.0F, 0.98F, 0.94F);
    boxes_.push_back(
        {block.table_from_block, block.half, albedo, add_box(mesh, block.table_from_block, block.half, false)});
  }
  Eigen::AlignedBox3d around;
  for (const auto& v : mesh.mesh.vertices) around.extend(v);
  middle_ = around.center();
  for (const auto& v : mesh.mesh.vertices) radius_ = std::max(radius_, (v - middle_).norm() + 0.5);
  const RayCaster rays(mesh.mesh);
  light_ = std::make_unique<RoomLight>(mesh, rays, Transform::Identity());
}

void BoardScene::add_print(Object& mesh) const {
  const BoardLayout& layout = board_.layout();
  for (int i = 0; i < kGridX * kGridY; ++i) {
    const int column = i % kGridX, row = i / kGridX;
    const double x = (column / (kGridX - 1.0) - 0.5) * layout.width();
    const double y = (row / (kGridY - 1.0) - 0.5) * layout.height();
    mesh.mesh.vertices.push_back(placed_.table_from_board * Vector3d(x, y, 0.0));
    mesh.normals.push_back(-placed_.table_from_board.linear().col(2));
  }
  for (int row = 0; row + 1 < kGridY; ++row) {
    for (int column = 0; column + 1 < kGridX; ++column) {
      const int a = row * kGridX + column;
      mesh.mesh.triangles.push_back({a, a + kGridX, a + 1});
      mesh.mesh.triangles.push_back({a + 1, a + kGridX, a + kGridX + 1});
    }
  }
}

/// Four vertices a face, so that its normals are its own. Returns the first.
int BoardScene::add_box(Object& mesh, const Transform& table_from_box, const Vector3d& half, bool open_front) {
  const int first = static_cast<int>(mesh.mesh.vertices.size());
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2, vertex = first + 4 * face;
    const double side = face % 2 == 0 ? -1.0 : 1.0;
    for (int i = 0; i < 4; ++i) {
      Vector3d at;
      at[axis] = side * half[axis];
      at[(axis + 1) % 3] = (i % 2 == 0 ? -1.0 : 1.0) * half[(axis + 1) % 3];
      at[(axis + 2) % 3] = (i / 2 == 0 ? -1.0 : 1.0) * half[(axis + 2) % 3];
      mesh.mesh.vertices.push_back(table_from_box * at);
      mesh.normals.push_back(side * table_from_box.linear().col(axis));
    }
    if (open_front && face == 4) continue;  // the print
    mesh.mesh.triangles.push_back({vertex, vertex + 1, vertex + 2});
    mesh.mesh.triangles.push_back({vertex + 1, vertex + 3, vertex + 2});
  }
  return first;
}

cv::Mat BoardScene::render(const Eye& camera, const RayMap& rays, double angle, std::uint64_t sampling_seed) const {
  const BoardShot shot(*this, camera, rays, angle);
  cv::Mat out(camera.height, camera.width, CV_32FC3);
  parallel_for(static_cast<std::size_t>(camera.height), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < camera.width; ++x) {
      const Vector3f light = render_pixel(shot, x, y, mix(sampling_seed, row, x));
      out.at<cv::Vec3f>(y, x) = {light.x(), light.y(), light.z()};
    }
  });
  return out;
}

}  // namespace scanrig::sim
