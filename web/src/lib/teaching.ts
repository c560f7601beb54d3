/** Whether the cars that are seen wait for a teacher, which learns before the first camera step. */
export const hasTeacherNow = (settings: Record<string, unknown>, step: number | undefined): boolean =>
  settings["algorithm"] === "distill" && !step;
