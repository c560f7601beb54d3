"""Names for models that nobody named: a word that one can say, of an animal, rather than a track and a date."""

from __future__ import annotations

import itertools
import random
from collections.abc import Container
from typing import Final

_WORDS: Final = """
adder alpaca ant auk badger bat bear beaver bee beetle bison boar bobcat buffalo bunting buzzard camel caribou
carp cat cheetah civet cobra cod colt condor coot cougar coyote crab crane cricket crow curlew deer dingo dipper
dog dolphin dove duck dunlin eagle eel egret eider elk emu ermine falcon ferret finch flamingo fox frog gannet
gazelle gecko gibbon giraffe gnu goat godwit goose grebe grouse gull hamster hare hawk hedgehog heron hornet
horse hyena ibex ibis iguana impala jackal jackdaw jaguar jay kestrel kingfisher kite kiwi koala kudu lapwing
lark lemming lemur leopard linnet lion lizard llama lobster lynx macaw magpie mallard manatee marlin marmot
marten martin meerkat merlin mink mole monkey moose moth mule newt nightjar ocelot okapi orca oriole osprey
otter owl oyster panda panther parrot partridge pelican penguin petrel pheasant pigeon pike pipit plover pony
possum puffin puma python quail rabbit raccoon raven redstart reindeer robin salmon sandpiper seal serval shark
sheep shrew shrike siskin skate skua skunk skylark snail snipe sparrow spider squid squirrel starling stoat
stork swallow swan swift tapir teal tern terrapin thrush tiger toad toucan trout tuna turtle viper vole vulture
wagtail walrus warbler wasp weasel whale wigeon wildcat wolf wombat woodcock woodpecker wren yak zebra
"""
ANIMALS: Final = tuple(_WORDS.split())


def free_name(taken: Container[str]) -> str:
    """A word that is not taken, by lot; with a number from 2 on where all words are."""
    words = random.SystemRandom().sample(ANIMALS, len(ANIMALS))
    numbered = (f"{word}-{number}" for number in itertools.count(2) for word in words)
    return next(name for name in itertools.chain(words, numbered) if name not in taken)
