#include "drivers/camera/network_card.h"

#include <gtest/gtest.h>

#include "core/files.h"
#include "tests/own_folder.h"

namespace scanrig {
namespace {

TEST(NetworkCard, TowardsThisMachineIsTheLoopback) {
  const auto card = network_card_to("127.0.0.1", "/nowhere");
  ASSERT_TRUE(card);
  EXPECT_EQ(card->name, "lo");
  EXPECT_FALSE(card->speed_mbit);
  EXPECT_GE(path_mtu("127.0.0.1"), 1500);
}

TEST(NetworkCard, HasTheSpeedThatTheKernelReports) {
  const auto root = own_folder("card_");
  ASSERT_TRUE(create_directories_synced(root / "sys/class/net/lo"));
  ASSERT_TRUE(write_file_atomically(root / "sys/class/net/lo/speed", std::string_view("100\n")));
  EXPECT_EQ(network_card_to("127.0.0.1", root.string())->speed_mbit, 100);
  ASSERT_TRUE(write_file_atomically(root / "sys/class/net/lo/speed", std::string_view("-1\n")));  // no link
  EXPECT_FALSE(network_card_to("127.0.0.1", root.string())->speed_mbit);
  std::filesystem::remove_all(root);
}

TEST(NetworkCard, OfWhatIsNoAddressIsUnknown) {
  EXPECT_FALSE(network_card_to("a camera"));
  EXPECT_EQ(path_mtu("a camera"), 0);
}

}  // namespace
}  // namespace scanrig
