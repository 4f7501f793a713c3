#include <unistd.h>

#include <cstdio>

#include "daemon/ctl/job_view.h"
#include "daemon/ctl/offline_rig_config.h"
#include "daemon/ctl/output.h"
#include "daemon/ctl/verbs.h"

namespace scanrig::ctl {
namespace {

using nlohmann::json;

constexpr int kPage = 500;
constexpr std::chrono::seconds kPackingTimeout{200};  ///< a bundle has to be made first
constexpr std::chrono::seconds kPerJobTimeout{1};     ///< a queued job's folder is on the disk at the reply

void print_job(const json& job) {
  fmt::print("{:<22} {:<16} {:>2} views  {:<12} {}\n", text(job, "id"), text(job, "state"), job.at("stored").get<int>(),
             text(job, "part"), job.at("error").is_object() ? text(job.at("error"), "message") : text(job, "model"));
}

/// The wanted number of jobs, over as many pages as needed.
tl::expected<json, RequestError> list(const Connection& connection, const JobsVerb& verb) {
  auto all = json::array();
  const std::string filter = verb.state.empty() ? "" : "&state=" + verb.state;
  for (std::string before;;) {
    const int wanted = std::min(kPage, verb.limit - static_cast<int>(all.size()));
    const auto page =
        send_request(connection.socket, "GET", fmt::format("/api/v1/jobs?limit={}{}{}", wanted, filter, before));
    if (!page) return tl::unexpected(page.error());
    for (const auto& job : page->at("jobs")) all.push_back(job);
    const auto next = text(*page, "next");
    if (next.empty() || static_cast<int>(all.size()) >= verb.limit) return json{{"jobs", all}};
    before = "&before=" + segment(next);
  }
}

/// Copies the daemon's reply to a file here, with a bar.
ExitCode save(const Connection& connection, const std::string& target, const std::string& name, const std::string& out,
              Clock::Duration limit = kReplyTimeout) {
  std::FILE* told = connection.json ? stderr : stdout;
  StageBars bars(told, ::isatty(::fileno(told)) == 1);
  const auto show = [&](std::uint64_t bytes, std::uint64_t of) {
    if (of > 0) bars.update(name, static_cast<double>(bytes) / static_cast<double>(of));
  };
  const auto done = download(connection.socket, target, out, show, limit);
  if (!done) return report_error(done.error());
  if (connection.json) {
    print({{"file", out}});
  } else {
    fmt::print("{}\n", out);
  }
  return ExitCode::ok;
}

}  // namespace

namespace {

ExitCode change_choice_or_poses(const Connection& connection, const JobsVerb& verb) {
  if (verb.id.empty()) return report_error(ExitCode::usage, "name the job: scanrig jobs ID choose N");
  const auto job = "/api/v1/jobs/" + segment(verb.id);
  const auto answer = verb.add_pose ? send_request(connection.socket, "POST", job + "/add-pose", "{}")
                                    : send_request(connection.socket, "POST", job + "/choose",
                                                   nlohmann::json{{"number", verb.choice}}.dump());
  if (!answer) return report_error(answer.error());
  if (connection.json) {
    print(*answer);
  } else if (verb.add_pose) {
    fmt::print("Lay the part another way and press Start: job {} is next.\n", verb.id);
  } else {
    fmt::print("The model of job {} is made with choice {}.\n", verb.id, verb.choice);
  }
  return ExitCode::ok;
}

}  // namespace

ExitCode jobs(const Connection& connection, const JobsVerb& verb) {
  if (verb.choice > 0 || verb.add_pose) return change_choice_or_poses(connection, verb);
  const auto answer = verb.id.empty() ? list(connection, verb)
                                      : send_request(connection.socket, "GET", "/api/v1/jobs/" + segment(verb.id));
  if (!answer) return report_error(answer.error());
  if (connection.json) {
    print(*answer);
  } else if (!verb.id.empty()) {
    for (const auto& line : job_lines(*answer)) fmt::print("{}\n", line);
  } else {
    for (const auto& job : answer->at("jobs")) print_job(job);
  }
  return ExitCode::ok;
}

ExitCode job_files(const Connection& connection, const std::string& id) {
  const auto answer = send_request(connection.socket, "GET", "/api/v1/jobs/" + segment(id) + "/files");
  if (!answer) return report_error(answer.error());
  if (connection.json) {
    print(*answer);
    return ExitCode::ok;
  }
  for (const auto& file : answer->at("files")) {
    fmt::print("{:>10}  {}\n", bytes_text(file.at("bytes")), text(file, "path"));
  }
  return ExitCode::ok;
}

ExitCode export_file(const Connection& connection, const ExportVerb& verb) {
  const auto out =
      verb.out.empty() ? verb.id + "-" + std::filesystem::path(verb.file).filename().string() : verb.out.string();
  const auto job = "/api/v1/jobs/" + segment(verb.id);
  if (const auto done = save(connection, job + "/files/" + segment(verb.file), verb.file, out); done != ExitCode::ok) {
    return done;
  }
  // A viewer may copy, but retention continues as without a copy.
  const auto noted = send_request(connection.socket, "POST", job + "/exported");
  return noted || noted.error().exit == ExitCode::refused ? ExitCode::ok : report_error(noted.error());
}

ExitCode bundle(const Connection& connection, const BundleVerb& verb) {
  const auto out = verb.out.empty() ? verb.id + ".tar.gz" : verb.out.string();
  return save(connection, "/api/v1/jobs/" + segment(verb.id) + "/bundle", verb.id, out, kPackingTimeout);
}

ExitCode queue(const Connection& connection, const QueueVerb& verb) {
  nlohmann::json body{{"recipe", verb.recipe}, {"repeat", verb.repeat}};
  if (!verb.part.empty()) body["part"] = verb.part;
  const auto answer = send_request(connection.socket, "POST", "/api/v1/jobs", body.dump(),
                                   kReplyTimeout + verb.repeat * kPerJobTimeout);
  if (!answer) return report_error(answer.error());
  if (connection.json) {
    print(*answer);
  } else {
    fmt::print("{}\n", text(*answer, "job"));
  }
  return ExitCode::ok;
}

ExitCode change_job(const Connection& connection, const JobVerb& verb) {
  const bool removes = verb.what == "delete";
  const auto job = "/api/v1/jobs/" + segment(verb.id);
  if (removes && !agreed(fmt::format("Delete job {} and all its files for good?", verb.id), verb.yes)) {
    return report_error(ExitCode::refused, "nothing was deleted: reply y, or give --yes where there is no terminal");
  }
  auto body = json::object();
  if (verb.voxel_mm) body["voxel_mm"] = *verb.voxel_mm;
  if (!verb.fusion.empty()) body["fusion"] = verb.fusion;
  const auto answer = removes ? send_request(connection.socket, "DELETE", job)
                              : send_request(connection.socket, "POST", job + "/" + verb.what, body.dump());
  if (!answer) return report_error(answer.error());
  if (connection.json) print(*answer);
  return ExitCode::ok;
}

}  // namespace scanrig::ctl
