from hw.fakes.can.can_peer import CanNodes as CanNodes
from hw.fakes.kairos.kairos_peer import Kairos as Kairos
from hw.fakes.peers import Cb3 as Cb3, VrClient as VrClient
from hw.fakes.sick.scanners import S300Peer as S300Peer
from hw.fakes.world_peer import WorldPeer as WorldPeer
