#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.h"
#include "core/transform.h"

/// Where pose 2 fits pose 1 in several ways that give different surfaces, a person picks one. The ways lie in the
/// scan's folder, and so does the pick: every later reconstruction finds it. Format: docs/reference/scan-folder.md.
namespace scanrig {

/// One of these ways.
struct PoseChoice {
  Transform pose1_from_pose2 = Transform::Identity();  ///< mm
  std::string sentence{};  ///< "pose 2 turned by 179.6 deg: 42 % of the surface confirmed, 0.3 % contradicted"
  std::string png{};       ///< the object from the front and from behind; empty: not drawn
};

/// Paths below the scan's folder; `number` from 1.
std::string choices_folder();
std::string choices_file();
std::string choice_image(int number);

/// Replaces all choices of a scan at once; none of the new ones is picked. Fails with `io`.
Result<void> write_choices(const std::filesystem::path& scan_folder, std::span<const PoseChoice> choices);

/// As they lie in the folder.
struct StoredChoices {
  struct Choice {
    Transform pose1_from_pose2;
    std::string sentence;
    bool has_image;  ///< choice_image()
  };
  std::vector<Choice> choices{};
  int picked = 0;  ///< from 1; 0: none yet
};
/// Empty where the scan has none. Fails with `invalid_input` and `unsupported`, naming the file, and `io`.
Result<StoredChoices> read_choices(const std::filesystem::path& scan_folder);

/// The motion that was picked, if one was. Fails as read_choices().
Result<std::optional<Transform>> picked_motion(const std::filesystem::path& scan_folder);

/// Records durably which one is right. Fails with `refused` (the scan has none), `invalid_input` (no such number), and
/// as read_choices().
Result<void> pick_choice(const std::filesystem::path& scan_folder, int number);

}  // namespace scanrig
