#include "sim/scene/effects.h"

#include <gtest/gtest.h>

#include "sim/scene/materials.h"

namespace scanrig::sim {
namespace {

TEST(Workshop, IsFrozen) {
  // A change of any magnitude needs a new version; then this hash is replaced.
  const ChosenProfile workshop{.effects = choose_effects("workshop", "", "").value()};
  EXPECT_EQ(workshop.sha256(), "2c6c570526ed5f3e9f3d43d6791a5bad68000744fec5570544498cf235e5169b");
}

TEST(Workshop, IsProfile1WithoutEffects) {
  EXPECT_EQ(ChosenProfile{}.sha256(), profile_sha256());
  EXPECT_TRUE(choose_effects("1", "", "")->is_none());
  EXPECT_TRUE(choose_effects("laboratory", "", "")->is_none());
  const auto none = choose_effects("2", "optics,sensor,projector,materials,turntable,drift,room", "");
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->is_none());
}

TEST(Workshop, HasEachSizeInOneEffect) {
  std::size_t sizes = 0;
  for (const Effect& effect : workshop_effects()) {
    for (const auto& size : effect.sizes) {
      EXPECT_NE(size.value, Effects{}.*size.member) << size.name;
      ++sizes;
    }
  }
  EXPECT_EQ(sizes * sizeof(double), sizeof(Effects));
}

TEST(Workshop, SwitchesEachEffectOffAlone) {
  for (const Effect& effect : workshop_effects()) {
    std::string asked;
    for (const Effect& other : workshop_effects()) {
      if (other.is_asked_for && other.name != effect.name) asked += std::string(other.name) + ",";
    }
    const auto without = choose_effects("workshop", effect.is_asked_for ? "" : effect.name, asked);
    ASSERT_TRUE(without) << effect.name;
    for (const Effect& other : workshop_effects()) {
      for (const auto& size : other.sizes) {
        EXPECT_EQ((*without).*size.member, other.name == effect.name ? Effects{}.*size.member : size.value)
            << effect.name << " " << size.name;
      }
    }
  }
}

TEST(Workshop, SparesTheObjectFromHandsThatNobodyAsksFor) {
  const Effects workshop = choose_effects("workshop", "", "").value();
  EXPECT_EQ(workshop.creep_mm, 0.0);
  EXPECT_EQ(workshop.sticker, 0.0);
  EXPECT_EQ(workshop.room_light, 0.0);
  const Effects rocked = choose_effects("workshop", "gloss", "rock,finger").value();
  EXPECT_GT(rocked.rock_deg, 0.0);
  EXPECT_GT(rocked.finger, 0.0);
  EXPECT_EQ(rocked.creep_mm, 0.0);
  EXPECT_EQ(rocked.gloss, 0.0);
}

TEST(Workshop, RefusesNamesThatDoNotExist) {
  const auto profile = choose_effects("garage", "", "");
  EXPECT_EQ(profile.error().code, ErrorCode::not_found);
  EXPECT_NE(profile.error().message.find("workshop (2)"), std::string::npos);
  const auto effect = choose_effects("workshop", "gloss,wobbel", "");
  EXPECT_EQ(effect.error().code, ErrorCode::not_found);
  EXPECT_NE(effect.error().message.find("wobbel"), std::string::npos);
  EXPECT_NE(effect.error().message.find(" wobble "), std::string::npos);
  EXPECT_EQ(choose_effects("workshop", "", "drop").error().code, ErrorCode::not_found);
  EXPECT_EQ(choose_effects("laboratory", "gloss", "").error().code, ErrorCode::invalid_input);
  const auto material = Materials::named("satin+velvet", {});
  EXPECT_EQ(material.error().code, ErrorCode::not_found);
  EXPECT_NE(material.error().message.find("velvet"), std::string::npos);
  EXPECT_EQ(Materials::named("", {}).error().code, ErrorCode::not_found);
}

TEST(Workshop, HasAnotherHashForEachChoice) {
  const ChosenProfile workshop{.effects = choose_effects("2", "", "").value()};
  ChosenProfile other = workshop;
  other.effects.runout_mm = 0.0;
  EXPECT_NE(other.sha256(), workshop.sha256());
  other = workshop;
  other.material = "gloss";
  EXPECT_NE(other.sha256(), workshop.sha256());
  other = workshop;
  other.coding.gamma = 0.45;
  EXPECT_NE(other.sha256(), workshop.sha256());
  other = workshop;
  other.material = "satin";  // what it has anyway
  EXPECT_EQ(other.sha256(), workshop.sha256());
}

}  // namespace
}  // namespace scanrig::sim
