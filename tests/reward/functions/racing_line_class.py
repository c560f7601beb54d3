'''Keeps state: where this car was first, in an object.'''
import math


class Reward:
    def __init__(self, verbose=False):
        self.first_racingpoint_index = None
        self.verbose = verbose

    def reward_function(self, params):

        ################## HELPER FUNCTIONS ###################

        def dist_2_points(x1, x2, y1, y2):
            return abs(abs(x1 - x2) ** 2 + abs(y1 - y2) ** 2) ** 0.5

        def closest_2_racing_points_index(racing_coords, car_coords):
            distances = []
            for i in range(len(racing_coords)):
                distance = dist_2_points(x1=racing_coords[i][0], x2=car_coords[0],
                                         y1=racing_coords[i][1], y2=car_coords[1])
                distances.append(distance)
            closest_index = distances.index(min(distances))
            distances_no_closest = distances.copy()
            distances_no_closest[closest_index] = 999
            second_closest_index = distances_no_closest.index(min(distances_no_closest))
            return [closest_index, second_closest_index]

        def dist_to_racing_line(closest_coords, second_closest_coords, car_coords):
            a = abs(dist_2_points(closest_coords[0], second_closest_coords[0],
                                  closest_coords[1], second_closest_coords[1]))
            b = abs(dist_2_points(car_coords[0], closest_coords[0], car_coords[1], closest_coords[1]))
            c = abs(dist_2_points(car_coords[0], second_closest_coords[0],
                                  car_coords[1], second_closest_coords[1]))
            try:
                distance = abs(-(a ** 4) + 2 * (a ** 2) * (b ** 2) + 2 * (a ** 2) * (c ** 2)
                               - (b ** 4) + 2 * (b ** 2) * (c ** 2) - (c ** 4)) ** 0.5 / (2 * a)
            except:
                distance = b
            return distance

        def next_prev_racing_point(closest_coords, second_closest_coords, car_coords, heading):
            heading_vector = [math.cos(math.radians(heading)), math.sin(math.radians(heading))]
            new_car_coords = [car_coords[0] + heading_vector[0], car_coords[1] + heading_vector[1]]
            d1 = dist_2_points(new_car_coords[0], closest_coords[0], new_car_coords[1], closest_coords[1])
            d2 = dist_2_points(new_car_coords[0], second_closest_coords[0],
                               new_car_coords[1], second_closest_coords[1])
            if d1 <= d2:
                return [closest_coords, second_closest_coords]
            return [second_closest_coords, closest_coords]

        def projected_time(first_index, closest_index, step_count, times_list):
            current_actual_time = (step_count - 1) / 15
            indexes_traveled = indexes_cyclical(first_index, closest_index, len(times_list))
            current_expected_time = sum([times_list[i] for i in indexes_traveled])
            total_expected_time = sum(times_list)
            try:
                return (current_actual_time / current_expected_time) * total_expected_time
            except ZeroDivisionError:
                return 9999

        def indexes_cyclical(start, end, array_len):
            if start is None:
                start = 0
            if end is None:
                end = 0
            if end < start:
                end += array_len
            return [index % array_len for index in range(start, end)]

        #################### RACING LINE ######################
        # Each row: [x, y, speed, timeFromPreviousPoint]
        racing_track = [[3.06, 0.68, 3.5, 0.08], [3.91, 0.69, 3.5, 0.24], [4.76, 0.71, 3.2, 0.25],
                        [5.55, 0.81, 2.4, 0.31], [6.20, 1.12, 1.9, 0.36], [6.55, 1.67, 1.8, 0.35],
                        [6.53, 2.31, 1.9, 0.34], [6.13, 2.80, 2.2, 0.30], [5.46, 3.02, 2.5, 0.29],
                        [4.86, 3.23, 2.5, 0.26], [4.45, 3.70, 2.2, 0.27], [3.84, 4.11, 2.3, 0.32],
                        [3.07, 4.19, 2.6, 0.31], [2.28, 4.08, 2.4, 0.32], [1.57, 3.72, 2.1, 0.36],
                        [1.03, 3.15, 2.0, 0.38], [0.86, 2.41, 1.9, 0.39], [1.06, 1.64, 2.1, 0.39],
                        [1.55, 1.04, 2.6, 0.33], [2.27, 0.73, 3.3, 0.25]]

        all_wheels_on_track = params['all_wheels_on_track']
        x = params['x']
        y = params['y']
        distance_from_center = params['distance_from_center']
        is_left_of_center = params['is_left_of_center']
        heading = params['heading']
        progress = params['progress']
        steps = params['steps']
        speed = params['speed']
        steering_angle = params['steering_angle']
        track_width = params['track_width']
        is_offtrack = params['is_offtrack']

        closest_index, second_closest_index = closest_2_racing_points_index(racing_track, [x, y])
        optimals = racing_track[closest_index]
        optimals_second = racing_track[second_closest_index]

        if self.verbose == True:
            self.first_racingpoint_index = 0
        if steps == 1 or self.first_racingpoint_index is None:
            self.first_racingpoint_index = closest_index

        ## Distance ##
        reward = 1
        DISTANCE_MULTIPLE = 1
        dist = dist_to_racing_line(optimals[0:2], optimals_second[0:2], [x, y])
        distance_reward = max(1e-3, 1 - (dist / (track_width * 0.5)))
        reward += distance_reward * DISTANCE_MULTIPLE

        ## Speed ##
        SPEED_DIFF_NO_REWARD = 1
        SPEED_MULTIPLE = 2
        speed_diff = abs(optimals[2] - speed)
        if speed_diff <= SPEED_DIFF_NO_REWARD:
            speed_reward = (1 - (speed_diff / (SPEED_DIFF_NO_REWARD)) ** 2) ** 2
        else:
            speed_reward = 0
        reward += speed_reward * SPEED_MULTIPLE

        # Reward if less steps
        REWARD_PER_STEP_FOR_FASTEST_TIME = 1
        STANDARD_TIME = 12
        FASTEST_TIME = 8
        times_list = [row[3] for row in racing_track]
        time = projected_time(self.first_racingpoint_index, closest_index, steps, times_list)
        try:
            steps_prediction = time * 15 + 1
            reward_prediction = max(1e-3, (-REWARD_PER_STEP_FOR_FASTEST_TIME * FASTEST_TIME /
                                           (STANDARD_TIME - FASTEST_TIME)) *
                                    (steps_prediction - (STANDARD_TIME * 15 + 1)))
            steps_reward = min(REWARD_PER_STEP_FOR_FASTEST_TIME, reward_prediction / steps_prediction)
        except:
            steps_reward = 0
        reward += steps_reward

        # Zero reward if obviously wrong direction (e.g. spin)
        nxt, prv = next_prev_racing_point(optimals[0:2], optimals_second[0:2], [x, y], heading)
        direction = math.degrees(math.atan2(nxt[1] - prv[1], nxt[0] - prv[0]))
        direction_diff = abs(direction - heading)
        if direction_diff > 180:
            direction_diff = 360 - direction_diff
        if direction_diff > 30:
            reward = 1e-3

        # Zero reward of obviously too slow
        if optimals[2] - speed > 0.5:
            reward = 1e-3

        ## Incentive for finishing the lap in less steps ##
        if progress == 100:
            finish_reward = max(1e-3, (-1500 / (15 * (STANDARD_TIME - FASTEST_TIME))) * (steps - STANDARD_TIME * 15))
        else:
            finish_reward = 0
        reward += finish_reward

        ## Zero reward if off track ##
        if all_wheels_on_track == False:
            reward = 1e-3

        if self.verbose == True:
            print("Closest index: %i" % closest_index)
            print("Distance to racing line: %f" % dist)
            print("=== Direction difference: %f ===" % direction_diff)
        return float(reward)


reward_object = Reward()


def reward_function(params):
    return reward_object.reward_function(params)
