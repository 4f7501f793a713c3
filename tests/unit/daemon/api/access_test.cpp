#include "daemon/api/access.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

TEST(PeerRoles, RootAndTheDaemonsUserAreEngineers) {
  EXPECT_EQ(PeerRoles{}.role_of({0, {}}), Role::engineer);
  EXPECT_EQ(PeerRoles{}.role_of({::geteuid(), {}}), Role::engineer);
}

TEST(PeerRoles, AGroupDecidesForOthersAndTheHighestCounts) {
  const PeerRoles roles{.viewer = 10, .operating = 20, .engineer = 30};
  constexpr uid_t kSomebody = 54321;
  EXPECT_EQ(roles.role_of({kSomebody, {99, 10}}), Role::viewer);
  EXPECT_EQ(roles.role_of({kSomebody, {10, 20}}), Role::operating);
  EXPECT_EQ(roles.role_of({kSomebody, {30, 10}}), Role::engineer);
  EXPECT_FALSE(roles.role_of({kSomebody, {99}})) << "in none of the groups";
  EXPECT_FALSE(PeerRoles{}.role_of({kSomebody, {0}})) << "no group is told";
}

TEST(Proxy, IsNamedByAddressOrByUser) {
  EXPECT_EQ(find_proxy("127.0.0.1")->address, "127.0.0.1");
  EXPECT_EQ(find_proxy("::ffff:10.1.2.3")->address, "10.1.2.3");
  EXPECT_EQ(find_proxy("unix:root")->user, uid_t{0});
  const auto none = find_proxy("");
  EXPECT_FALSE(none->address || none->user);
  EXPECT_EQ(find_proxy("proxy.example").error().code, ErrorCode::invalid_input);
  EXPECT_EQ(find_proxy("unix:nobody-of-that-name").error().code, ErrorCode::not_found);
}

TEST(ForwardedAddress, IsTheLastOneWhichTheProxyItselfAppended) {
  EXPECT_EQ(forwarded_address("10.0.0.7"), "10.0.0.7");
  EXPECT_EQ(forwarded_address("1.2.3.4, 5.6.7.8 ,\t2001:DB8::0:1 "), "2001:db8::1");
  EXPECT_EQ(forwarded_address("::ffff:10.0.0.7"), "10.0.0.7");
  for (const auto* const bad : {"", " ", "10.0.0.7,", "unknown", "10.0.0", "10.0.0.7:80", "10.0.0.7, _hidden"}) {
    EXPECT_FALSE(forwarded_address(bad)) << bad;
  }
}

TEST(PeerCredentials, AreThoseOfTheOtherEnd) {
  int ends[2];
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
  const auto peer = peer_credentials(ends[0]);
  ASSERT_TRUE(peer) << peer.error().message;
  EXPECT_EQ(peer->uid, ::geteuid());
  EXPECT_NE(std::ranges::find(peer->groups, ::getegid()), peer->groups.end());
  ::close(ends[0]);
  ::close(ends[1]);
  EXPECT_EQ(peer_credentials(-1).error().code, ErrorCode::io);
}

TEST(PeerCredentials, AGroupIsFoundByItsName) {
  const auto roles = find_groups({.operating = "root"});
  ASSERT_TRUE(roles) << roles.error().message;
  EXPECT_EQ(roles->operating, 0u);
  EXPECT_FALSE(roles->viewer || roles->engineer);
  EXPECT_EQ(find_groups({.viewer = "no-such-group-here"}).error().code, ErrorCode::not_found);
  EXPECT_EQ(find_groups({})->operating, ::getegid()) << "no group named: the service's own group";
}

class AccessTest : public scan_samples::FolderTest {
 protected:
  std::filesystem::path path() const { return folder_ / "tokens.json"; }
  static std::optional<Role> role_of(Access& access, std::optional<Role> peer, const std::string& authorization) {
    return access.identify(peer, authorization, "", std::chrono::system_clock::now()).role;
  }
};

TEST_F(AccessTest, ATokenThatIsShownDecidesAndNotThePeer) {
  TokenFile tokens;
  const auto token = *tokens.add("tablet", Role::operating, "now");
  ASSERT_TRUE(tokens.write(path()));
  Access access({}, path());
  EXPECT_EQ(role_of(access, std::nullopt, ""), std::nullopt);
  EXPECT_EQ(role_of(access, Role::viewer, ""), Role::viewer);
  EXPECT_EQ(role_of(access, std::nullopt, "Bearer " + token), Role::operating);
  EXPECT_EQ(role_of(access, std::nullopt, "bearer " + token), Role::operating);
  EXPECT_EQ(role_of(access, Role::engineer, "Bearer wrong"), std::nullopt);
  EXPECT_EQ(role_of(access, Role::engineer, "Basic " + token), std::nullopt);
  EXPECT_EQ(role_of(access, Role::engineer, "Bearer"), std::nullopt);
}

TEST_F(AccessTest, TokensThatBecomeUnreadableAreVoidAndThatIsSaid) {
  TokenFile tokens;
  const auto token = "Bearer " + *tokens.add("tablet", Role::operating, "now");
  ASSERT_TRUE(tokens.write(path()));
  Access access({}, path());
  EXPECT_FALSE(access.problem());
  ::chmod(path().c_str(), 0644);
  access.refresh();
  EXPECT_FALSE(role_of(access, std::nullopt, token));
  ASSERT_TRUE(access.problem());
  EXPECT_EQ(access.problem()->code, ErrorCode::refused);
  ::chmod(path().c_str(), 0600);
  access.refresh();
  EXPECT_EQ(role_of(access, std::nullopt, token), Role::operating);
}

TEST_F(AccessTest, ALoginIsVoidWithItsTokenAndNeverMayMoreThanIt) {
  const auto now = std::chrono::system_clock::now();
  TokenFile tokens;
  const auto token = *tokens.add("tablet", Role::engineer, "now");
  ASSERT_TRUE(tokens.write(path()));
  Access access({}, path(), folder_ / "logins.json");
  EXPECT_FALSE(*access.log_in_by_token("scanrig_wrong", now));
  const auto cookie = **access.log_in_by_token(token, now);
  const auto who = access.identify(std::nullopt, "", cookie, now);
  EXPECT_EQ(who.role, Role::engineer);
  EXPECT_EQ(who.token, "tablet");
  EXPECT_EQ(who.cookie, cookie);

  ASSERT_TRUE(tokens.revoke("tablet"));
  ASSERT_TRUE(tokens.add("tablet", Role::engineer, "later")) << "another one of the same name";
  ASSERT_TRUE(tokens.write(path()));
  access.refresh();
  EXPECT_FALSE(access.identify(std::nullopt, "", cookie, now).role);
}

TEST_F(AccessTest, ACodeGivesAtMostTheRoleOfWhoAskedForIt) {
  const auto now = std::chrono::system_clock::now();
  Access access({}, path());
  const Identity operating{.role = Role::operating};
  EXPECT_EQ(access.offer_code(operating, Role::engineer, false, now).error().code, ErrorCode::refused);
  const auto code = *access.offer_code(operating, Role::viewer, false, now);
  const auto cookie = **access.log_in_by_code(code, now);
  EXPECT_EQ(access.identify(std::nullopt, "", cookie, now).role, Role::viewer);
  EXPECT_FALSE(*access.log_in_by_code(code, now)) << "it counts once";
}

}  // namespace
}  // namespace scanrig
