/** Was der Server beim Namen nennt: Belohnungen, Aktionsräume, Situationen des Probelaufs. */
import type { presets as english } from "../en/presets";

export const presets: Record<keyof typeof english, string> = {
  preset_anti_zigzag: "Der Mittellinie folgen, ohne zu pendeln: Starkes Lenken kostet ein Fünftel der Belohnung.",
  preset_centerline: "Der Mittellinie folgen: je näher, desto besser. Das ist die übliche Belohnung des Originals.",
  preset_dodge:
    "Zwischen Kisten und anderen Autos fahren: Jeder Meter zählt, weniger, je mehr das nächste Hindernis im Weg steht.",
  preset_duel:
    "Zu zweit fahren: Es zählt jeder wirklich gewonnene Meter, mehr, wo er einem nahen Auto abgenommen ist; Fehler sind teuer.",
  preset_heading:
    "Das Auto entlang der Strecke ausrichten: Bei mehr als zehn Grad Abweichung geht die halbe Belohnung verloren.",
  preset_lap_time:
    "Gegen die Uhr: Es zählt jeder Meter der Runde, den das Auto seit dem letzten Schritt wirklich gewonnen hat.",
  preset_object_avoidance:
    "Auf der Straße bleiben und Kisten und Autos ausweichen: Die Lücke voraus zählt mehr als die Spur.",
  preset_overtake:
    "Überholen: weiterfahren, die Spur des Autos voraus meiden und für jeden Meter bezahlt werden, der aufgeholt ist.",
  preset_progress_pace:
    "In weniger Schritten ankommen: alle hundert Schritte ein Zuschlag für ein Auto, das vor dem Zieltempo liegt.",
  preset_racing:
    "Rennen: Jeder Meter entlang der Strecke in diesem Schritt zählt. Lernt schnell und lernt, schnell zu fahren.",
  preset_slalom:
    "Zwischen Kisten und anderen Autos schneller als im Schritt fahren: Jeder Meter zählt, und Fehler sind teuer.",
  preset_speed_gate: "Auf der Strecke bleiben und nicht trödeln: Unter einem Mindesttempo ist die halbe Belohnung weg.",
  preset_stay_inside:
    "Innerhalb der Ränder bleiben: Jede Linie ist recht, solange alle Räder mit etwas Luft auf der Straße sind.",
  preset_touring:
    "Fremde Straßen fahren: zahlt für jeden wirklich gewonnenen Meter, aber nicht für eine Kurve am Limit.",
  space_default: "Fünf Lenkwinkel bei 1 und 2 m/s: lernt in Sekunden.",
  space_aws: "Wie bei AWS: fünf Lenkwinkel bei 0,5 und 1 m/s.",
  space_fast: "Sieben Lenkwinkel bei bis zu 4 m/s: für Rekorde.",
  space_safe: "Sieben Lenkwinkel bei 0,7 und 1,4 m/s: kommt überall herum.",
  space_steady: "Fünf Lenkwinkel bei 1 m/s: zwischen Kisten und anderen Autos.",
  space_continuous: "Jeder Lenkwinkel, jedes Tempo von 0,5 bis 4 m/s.",
  preset_name_anti_zigzag: "Ohne Pendeln",
  preset_name_centerline: "Mittellinie",
  preset_name_dodge: "Ausweichen",
  preset_name_duel: "Duell",
  preset_name_heading: "Ausrichtung",
  preset_name_lap_time: "Rundenzeit",
  preset_name_object_avoidance: "Hindernisse",
  preset_name_overtake: "Überholen",
  preset_name_progress_pace: "Zieltempo",
  preset_name_racing: "Rennen",
  preset_name_slalom: "Slalom",
  preset_name_speed_gate: "Mindesttempo",
  preset_name_stay_inside: "Drinnen bleiben",
  preset_name_touring: "Fremde Straßen",
  space_name_default: "Standard",
  space_name_aws: "AWS",
  space_name_fast: "Schnell",
  space_name_safe: "Sicher",
  space_name_steady: "Ruhig",
  space_name_continuous: "Stufenlos",
  situation_start: "Erster Schritt einer Episode, auf der Startlinie.",
  situation_straight: "Geradeaus auf der Mittellinie.",
  situation_bend_left: "In der engsten Linkskurve, in sie hinein gelenkt.",
  situation_bend_right: "In der engsten Rechtskurve, in sie hinein gelenkt.",
  situation_slow: "Auf der Mittellinie mit einem halben Meter in der Sekunde.",
  situation_fast: "Auf der Mittellinie mit vier Metern in der Sekunde.",
  situation_left_edge: "Zwei Räder über dem linken Rand.",
  situation_right_edge: "Um eine Radbreite innerhalb des rechten Randes.",
  situation_sideways: "Auf der Mittellinie, quer zur Strecke.",
  situation_backwards: "Auf der Mittellinie, in die falsche Richtung gedreht.",
  situation_off_track: "Alle Räder jenseits des rechten Randes, Ende der Episode.",
  situation_other_way: "Auf der Mittellinie, die Strecke andersherum gefahren.",
  situation_on_pace: "Nach genau 100 Schritten, zwei Drittel der Runde geschafft.",
  situation_near_an_object: "Geradewegs auf ein Hindernis zu.",
  situation_crash: "In ein Hindernis, Ende der Episode.",
  situation_before_the_line: "Auf dem letzten Stück der Runde, kurz vor der Ziellinie.",
  situation_finish: "Die Runde ist geschafft.",
};
