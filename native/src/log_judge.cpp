#include "log_judge.hpp"

#include <limits>

namespace racecraft {

void judge_log(const TrackGeometry& track, bool is_reversed, const LoggedRow* log, size_t count,
               double* rows) {
    constexpr RuleLimits kNoLimits{std::numeric_limits<int32_t>::max(), std::numeric_limits<int32_t>::max(),
                                   0.0};
    Episode episode{};
    episode.episode = -1;
    for (size_t i = 0; i < count; ++i) {
        const LoggedRow& logged = log[i];
        VehicleState state{};
        state.heading = static_cast<float>(logged.heading);
        if (logged.is_first != 0.0) {
            const int32_t number = episode.episode + 1;
            episode = Episode{};
            episode.episode = number;
        }
        sincos_of(state.heading, episode.sine, episode.cosine);
        episode.reference_x = logged.x;
        episode.reference_y = logged.y;
        episode.projection = project(track, logged.x, logged.y);
        state.x = static_cast<float>(logged.x - static_cast<double>(kReferenceAhead * episode.cosine));
        state.y = static_cast<float>(logged.y - static_cast<double>(kReferenceAhead * episode.sine));
        const float steering = static_cast<float>(logged.steering_angle);
        const float speed = static_cast<float>(logged.speed);
        double* row = rows + i * kNumRowColumns;
        if (logged.is_first == 0.0) {
            const int32_t laps = episode.laps;
            judge(track, kNoLimits, state, steering, speed, is_reversed, false, episode, row);
            if (logged.is_paused != 0.0) {
                // A car that stands is only looked at: no lap, and nothing counts against it afterwards.
                if (episode.laps > laps) episode.progress += 1.0;
                episode.laps = laps;
                episode.falling_steps = 0;
                episode.still_steps = 0;
                row[kRow_status] = static_cast<int32_t>(Status::pause);
                row[kRow_lap] = laps;
            }
            continue;
        }
        // As the engine begins an episode, but the log tells the progress.
        episode.steps = 1;
        episode.status = Status::prepare;
        episode.progress = logged.progress;
        episode.start = episode.projection.arc_length / track.length - logged.progress;
        episode.last_x = episode.reference_x;
        episode.last_y = episode.reference_y;
        write_row(track, episode, state, steering, speed, wheels_on_road(track, state, episode), is_reversed,
                  row);
    }
}

}  // namespace racecraft
