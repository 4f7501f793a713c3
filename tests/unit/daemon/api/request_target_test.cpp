#include "daemon/api/request.h"

#include <gmock/gmock.h>

namespace scanrig {
namespace {

using testing::ElementsAre;
using testing::Pair;

TEST(RequestTarget, IsTakenApartAndDecoded) {
  const auto target = parse_target("/api/v1/jobs/a%20b?limit=5&before=x%2Fy&flag");
  ASSERT_TRUE(target) << target.error().message;
  EXPECT_THAT(target->segments, ElementsAre("api", "v1", "jobs", "a b"));
  EXPECT_THAT(target->query, ElementsAre(Pair("limit", "5"), Pair("before", "x/y"), Pair("flag", "")));
}

TEST(RequestTarget, TheRootHasNoSegments) {
  EXPECT_TRUE(parse_target("/")->segments.empty());
  EXPECT_THAT(parse_target("/?a=1")->query, ElementsAre(Pair("a", "1")));
}

TEST(RequestTarget, AnEscapedSlashStaysInItsSegment) {
  EXPECT_THAT(parse_target("/files/pose1%2Fview00%2Fa.png")->segments, ElementsAre("files", "pose1/view00/a.png"));
}

TEST(RequestTarget, WhatLeavesItsFolderOrHidesItsMeaningIsRefused) {
  for (const auto* target : {"",          "api",     "//",         "/a//b",       "/a/",        "/../etc/passwd",
                             "/a/..",     "/a/.",    "/%2e%2e/x",  "/a%2F..%2Fb", "/a%2F..",    "/..%2Fa",
                             "/a%2F%2Fb", "/%2Fetc", "/a%2F",      "/a%00b",      "/a%0ab",     "/a%7f",
                             "/a\x01",    "/a%5c..", "/a\\b",      "/%",          "/%2",        "/%zz",
                             "/a?b=%",    "/a?=1",   "/a?b=1&b=2", "/a?b=%0d%0a", "/a?b=1&&c=2"}) {
    const auto parsed = parse_target(target);
    ASSERT_FALSE(parsed) << target;
    EXPECT_EQ(parsed.error().code, ErrorCode::invalid_input);
  }
  EXPECT_FALSE(parse_target("/" + std::string(2048, 'a')));
}

}  // namespace
}  // namespace scanrig
