#pragma once

#include <filesystem>

namespace scanrig {

/// Folder of the crash reports for a rig with this storage root: $STATE_DIRECTORY/crash, or in `.state` of the root. No
/// job's id starts with a dot.
std::filesystem::path crash_folder(const std::filesystem::path& storage_root);

/// From now on a crash of this process (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT) writes FOLDER/SECONDS-PID.txt: the
/// signal and a back-trace of the crashed thread. Then the signal ends the process as it would have. At most
/// the 5 newest are kept. Without a writable folder there is no report, and nothing else changes.
/// A sanitizer's own report is left to it. Call once, from main's thread.
void report_crashes_to(const std::filesystem::path& folder);

}  // namespace scanrig
