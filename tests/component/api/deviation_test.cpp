#include "core/files.h"
#include "pipeline/deviation/model_deviation.h"
#include "pipeline/deviation/references.h"
#include "pipeline/model_io/model_files.h"
#include "tests/component/api/api_bench.h"
#include "tests/slowness.h"
#include "tests/unit/pipeline/deviation/part.h"

namespace scanrig {
namespace {

using api_bench::Answer;
using api_bench::ApiBench;
using ::testing::HasSubstr;

class DeviationOfTheApi : public ApiBench {
 protected:
  void SetUp() override {
    ApiBench::SetUp();
    Mesh part = deviation_part::part_mesh(2.0);
    ASSERT_TRUE(write_file_atomically(folder_ / "a.stl", encode_stl(part)));
    ASSERT_TRUE(add_reference(folder_, "bracket", folder_ / "a.stl"));
    part.views.assign(part.vertices.size(), 2);
    part.views[3] = 0;
    const auto lying = deviation_part::moved_mesh(part, deviation_part::some_motion(70.0));
    ASSERT_TRUE(write_file_atomically(folder_ / "jobs/old/model/view.glb",
                                      *encode_view_glb({.mesh = lying, .corner_uv = {}, .atlas = {}})));
    ASSERT_TRUE(
        write_file_atomically(folder_ / "b.stl", encode_stl(::scanrig::testing::box_mesh({0, 0, 0}, {60, 50, 40}))));
    ASSERT_TRUE(add_reference(folder_, "box", folder_ / "b.stl"));
    serve();
  }
  Answer get(const std::string& target) {
    auto wire = tcp();
    wire.wait_at_most(std::chrono::seconds(200));  // it computes at low priority
    return ask(std::move(wire), request("GET", "/api/v1" + target, tokens[Role::viewer]));
  }
};

TEST_F(DeviationOfTheApi, AModelIsComparedOnceAndItsFileHasAValuePerVertex) {
  EXPECT_EQ(get("/references").json()["references"][0]["name"], "box");
  EXPECT_EQ(get("/references").json()["references"][1]["name"], "bracket");
  const auto first = get("/jobs/old/deviation?reference=bracket");
  ASSERT_EQ(first.status, 200) << first.body;
  const auto told = first.json();
  EXPECT_EQ(told["model_file"], "model/view.glb");
  EXPECT_LT(told["p95_mm"], 0.05);
  EXPECT_GT(told["confirmed"], 0.98);
  EXPECT_EQ(told["fits_otherwise"], false);
  const auto again = get("/jobs/old/deviation?reference=bracket");
  EXPECT_EQ(again.body, first.body);
  auto file = told["values_file"].get<std::string>();
  for (std::size_t at = 0; (at = file.find('/')) != std::string::npos;) file.replace(at, 1, "%2F");
  const auto values = get("/jobs/old/files/" + file);
  ASSERT_EQ(values.status, 200);
  EXPECT_EQ(values.body.size(), 2 * told["vertices"].get<std::size_t>());
}

TEST_F(DeviationOfTheApi, WhatCannotBeComparedIsRefusedByOneSentence) {
  const auto other = get("/jobs/old/deviation?reference=box");
  EXPECT_EQ(other.status, 409);
  EXPECT_THAT(other.body, HasSubstr("the reference does not fit"));
  EXPECT_EQ(get("/jobs/old/deviation?reference=none").status, 404);
  EXPECT_EQ(get("/jobs/old/deviation?reference=..%2Fsecret").status, 404);
  EXPECT_EQ(get("/jobs/none/deviation?reference=box").status, 404);
  EXPECT_EQ(get("/jobs/old/deviation").status, 400);
}

TEST_F(DeviationOfTheApi, StopIsAnsweredWhileModelsAreCompared) {
  auto comparing = tcp(2);
  ASSERT_TRUE(comparing.say(request("GET", "/api/v1/jobs/old/deviation?reference=box", tokens[Role::viewer])));
  for (int i = 0; i < 5; ++i) {
    const auto begun = std::chrono::steady_clock::now();
    EXPECT_EQ(ask(tcp(), request("POST", "/api/v1/stop", tokens[Role::viewer])).status, 200);
    EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::milliseconds(100) * kSlowness);
  }
}

}  // namespace
}  // namespace scanrig
