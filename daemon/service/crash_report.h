#pragma once

#include <filesystem>

namespace scanrig {

/// Where crash reports of a rig with this storage root are: $STATE_DIRECTORY/crash, or in `.state` of the root: no
/// job's id begins with a dot.
std::filesystem::path crash_folder(const std::filesystem::path& storage_root);

/// From now on a crash of this process (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT) leaves FOLDER/SECONDS-PID.txt: the
/// signal and a back-trace of the thread that crashed; then the process ends by the signal as it would have. At most
/// the 5 newest are kept. Without a folder that can be written there is no report, and nothing else changes.
/// A sanitizer's own report is left to it. Called once, by main's thread.
void report_crashes_to(const std::filesystem::path& folder);

}  // namespace scanrig
