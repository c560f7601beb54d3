/** How it stands with a training, as a sentence. */
import { seconds } from "../lib/numbers";
import type { Lesson } from "./lesson.svelte";
import { l } from "./text";

/** `cars`: how many will learn, until it is seen how many do. */
export function saidOf(lesson: Lesson, cars: number): string {
  const time = seconds(lesson.seconds, 1);
  switch (lesson.state) {
    case "ready":
      return l(lesson.look ? "shown" : "ready", { count: cars });
    case "loading":
      return l("loading");
    case "learning":
      return l("learning", { count: lesson.look?.poses.length ?? cars });
    case "reached":
      return l("reached", { laps: lesson.judged?.laps ?? 0, time });
    case "unreached":
      return l("unreached", { time });
    case "stopped":
      return l("stopped", { time });
    case "failed":
      if (lesson.failedReward) return l(lesson.judged ? "reward_failed_kept" : "reward_failed", { time });
      if (lesson.pythonFailure) return l("python_unable", { why: lesson.pythonFailure });
      return l("unable", { why: lesson.failure });
  }
}
