/** What the server offers by name: rewards, action spaces, situations of the dry run. */
export const presets = {
  preset_anti_zigzag: "Follow the centre line without zigzagging: hard steering costs a fifth of the reward.",
  preset_centerline: "Follow the centre line: the closer, the better. This is the platform's default reward.",
  preset_dodge:
    "Race among boxes and other cars: pay for every metre, less the more squarely the next object stands in the way.",
  preset_duel: "Race head to head: pay for every metre really gained, and make mistakes dearer than they are alone.",
  preset_heading: "Point the car along the track: half of the reward is lost when it looks more than ten degrees away.",
  preset_lap_time:
    "Race against the clock: pay for every metre of the lap that the car really gained since the last step.",
  preset_object_avoidance:
    "Keep to the road and out of the way of boxes and other cars: the gap ahead counts more than the lane.",
  preset_overtake: "Overtake: race on, keep out of the lane of a car ahead, and be paid for the metres gained on it.",
  preset_progress_pace:
    "Finish in fewer steps: a bonus every hundred steps for a car that is ahead of the target pace.",
  preset_racing:
    "Race: pay for every metre gained along the track in this step. Learns fast, and learns to drive fast.",
  preset_speed_gate: "Stay on the track and do not dawdle: below a speed threshold half of the reward is gone.",
  preset_stay_inside:
    "Stay inside the borders: any line will do, as long as all wheels are on the road with room to spare.",
  space_default: "Five steering angles at 1 and 2 m/s: learns in seconds.",
  space_aws: "AWS's own: five steering angles at 0.5 and 1 m/s.",
  space_fast: "Seven steering angles at up to 4 m/s: for records.",
  space_safe: "Seven steering angles at 0.7 and 1.4 m/s: gets round everywhere.",
  space_steady: "Five steering angles at 1 m/s: among boxes and other cars.",
  space_continuous: "Any steering angle, any speed from 0.5 to 4 m/s.",
  situation_start: "First step of an episode, on the start line.",
  situation_straight: "Straight ahead on the centre line.",
  situation_bend_left: "In the tightest bend to the left, steering into it.",
  situation_bend_right: "In the tightest bend to the right, steering into it.",
  situation_slow: "On the centre line at half a metre a second.",
  situation_fast: "On the centre line at four metres a second.",
  situation_left_edge: "Two wheels over the left border.",
  situation_right_edge: "Inside the right border, by a wheel's width.",
  situation_sideways: "On the centre line, looking across the track.",
  situation_backwards: "On the centre line, looking the wrong way.",
  situation_off_track: "All wheels beyond the right border, end of the episode.",
  situation_other_way: "On the centre line, driving the track in the other direction.",
  situation_on_pace: "After exactly 100 steps, two thirds of the lap done.",
  situation_finish: "The lap is complete.",
} as const;
