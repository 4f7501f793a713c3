#include "daemon/api/origins.h"

#include <gtest/gtest.h>

namespace scanrig {
namespace {

TEST(Origins, HostsAreAddressesAndNamesOfThisMachine) {
  const OwnOrigins origins("https://rig.example");
  for (const auto* own : {"127.0.0.1", "127.0.0.1:8080", "[::1]:8080", "[fe80::1]", "localhost", "LOCALHOST:8080",
                          "rig.local", "rig.example", "rig.example:443"}) {
    EXPECT_TRUE(origins.is_own_host(own)) << own;
  }
  for (const auto* foreign : {"", "evil.example", "127.0.0.1.evil.example", "local", ".local", "localhost.evil.example",
                              "evil.example:8080", "rig.example.evil.example", "127.0.0.1:80:80", "localhost:8o8o"}) {
    EXPECT_FALSE(origins.is_own_host(foreign)) << foreign;
  }
  EXPECT_FALSE(OwnOrigins("").is_own_host("rig.example"));
}

TEST(Origins, AnOriginIsOwnUnderTheHostThatServedIt) {
  const OwnOrigins origins("https://rig.example");
  EXPECT_TRUE(origins.is_own_origin("http://127.0.0.1:8080", "127.0.0.1:8080"));
  EXPECT_TRUE(origins.is_own_origin("https://rig.example", "rig.example"));
  for (const auto* foreign : {"", "null", "http://127.0.0.1", "https://127.0.0.1:8080", "http://evil.example",
                              "http://rig.example", "https://rig.example.evil.example"}) {
    EXPECT_FALSE(origins.is_own_origin(foreign, "127.0.0.1:8080")) << foreign;
  }
}

TEST(Origins, OneCookieOfAHeader) {
  EXPECT_EQ(cookie_value("scanrig=ab", "scanrig"), "ab");
  EXPECT_EQ(cookie_value("a=b; scanrig=ab; c=d", "scanrig"), "ab");
  EXPECT_EQ(cookie_value("xscanrig=ab; scanrig2=cd", "scanrig"), "");
  EXPECT_EQ(cookie_value(";;; =; scanrig", "scanrig"), "");
  EXPECT_EQ(cookie_value("", "scanrig"), "");
}

}  // namespace
}  // namespace scanrig
