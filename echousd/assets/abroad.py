"""Furniture by its German, French, Spanish, Italian, Dutch and Portuguese names: which English ones they are."""

from __future__ import annotations

import re
import unicodedata

# First match wins: pattern on the name in small letters without accents, English word; "" = nothing of ours.
WORDS: tuple[tuple[str, str], ...] = (
    (r"ku(e)?chen|de cuisine|de cocina|da cucina|keuken|de cozinha|lavabo|wasch|wastafel|evier|fregadero|lavello", ""),
    (r"ku(e)?hlschrank|oberschrank|koelkast|(armario|armadio) (superior|alto)", ""),
    (r"fenster|fenetre|ventana|finestra|janela|\bture?n?\b|zimmertur|porte\b|puerta|escalier|treppe|trap\b", ""),
    (r"tischl(ampe|euchte)|lampe de (chevet|bureau|table)|lampara de (mesa|escritorio)|lampada da (tavolo|scrivania)"
     r"|tafellamp|bureaulamp|werklamp|flexo\b|(candeeiro|abajur|luminaria) de mesa", "table lamp"),
    (r"stehl(ampe|euchte)|lampadaire|lampara de pie|lampada da terra|piantana|vloerlamp|staande lamp"
     r"|deckenfluter|floor uplight|torchiere|(candeeiro|luminaria|luz|lampada) de (pe|chao)", "floor lamp"),
    (r"(decken|zimmer)l(ampe|euchte)|plafonnier|plafon(d|iera)?(lamp)?\b", "ceiling lamp"),
    (r"wandl(ampe|euchte)|applique|aplique|lampada da parete|wandlamp|wandfluter"
     r"|arandela|luz de parede|wall uplight|sconce", "wall lamp"),
    (r"(hange|haenge|pendel)l(ampe|euchte)|kronleuchter|suspension|lampara (colgante|de techo)|lampadario|hanglamp"
     r"|lampada a sospensione|candeeiro de (teto|suspensao)|lustre\b", "pendant lamp"),
    (r"etagenbett|stockbett|hochbett|(kinder|baby|gitter)bett|lits? (superpose|mezzanine|de bebe|d.enfant|bebe)|litera"
     r"|cuna\b|letto a castello|lettino|stapelbed|hoogslaper|kinderbed|wieg\b|beliche|bercos?\b", "bunk bed"),
    (r"nachttisch|nachtkonsole|chevet|table de nuit|mes(a|ita|illa) de noche|mesita\b|comodino|nachtkast|cabeceira"
     r"|criado.?mudo|mesa de quarto", "nightstand"),
    (r"schmink|coiffeuse|tocador|da toeletta|kaptafel|toucador|penteadeira", "dressing table"),
    (r"schreibtisch|\bbureau\b|escritorio|scrivania|schrijftafel|escrivaninha|secretaria", "desk"),
    (r"couchtisch|sofatisch|table basse|mesa (de centro|baja|de cafe)|tavolino|salontafel", "coffee table"),
    (r"beistelltisch|bout de canape|mesa (auxiliar|lateral|de apoio)|bijzettafel", "side table"),
    (r"mesa (para |de )?tv|(tv|fernseh).?(mobel|schrank|bank|tisch|meubel|kast)"
     r"|(meuble|mueble|mobile|movel|rack)( para| porta| de)? ?tv"
     r"|porta tv|banc tv", "tv stand"),
    (r"fernseher|televis(eur|or|ore|ie)\b", "television"),
    (r"ecksofa|eckcouch|canape d.angle|sofa (esquin|rinconera|de canto)|divano (angolare|ad angolo)|hoekbank",
     "corner sofa"),
    (r"liegesessel|chaise longue|tumbona", "chaise longue"),
    (r"sessel|fauteuil|sillon\b|butaca|poltrona|leunstoel|armstoel", "armchair"),
    (r"canape|divano|bankstel|\bbank\b|\bsofa|couch", "sofa"),
    (r"bu(e)?rostuhl|drehstuhl|chaise de bureau|silla de oficina|sedia (da|per) ufficio|bureaustoel"
     r"|cadeira de escritorio", "office chair"),
    (r"bar(hocker|stuhl)|(tabouret|chaise) de bar|(taburete|banqueta|banco) de bar|sgabello da bar|barkruk",
     "bar stool"),
    (r"hocker\b|tabouret|taburete|tamborete|sgabello|kruk(je)?\b|banqueta|\bbanco\b", "stool"),
    (r"sitzbank|\bbanc\b|panca\b|panchina|zitbank", "bench"),
    (r"stuhl\b|stuhle|\bchaises?\b|\bsillas?\b|\bsedi[ae]\b|stoel\b|cadeira", "chair"),
    (r"kleiderschrank|penderie|armoire|armario|guardaroba|armadio|kleding ?kast|roupeiro|guarda.?roupa", "wardrobe"),
    (r"bu(e)?cher(regal|schrank)|bibliothe(que|ek)|libreria|estanteria|boekenkast|estante\b|librero", "bookcase"),
    (r"kommode|\bcommode|comoda\b|cassettiera|ladekast|\bkist\b", "dresser"),
    (r"anrichte|buffet|bahut|enfilade|aparador|credenza|dressoir", "sideboard"),
    (r"regal\b|etagere|scaffal|\bplank\b|prateleira|repisa|balda\b", "shelf"),
    (r"schrank|placard|vitrine|vi?e?trina|\bkast\b|armadietto|cristaleira", "cabinet"),
    (r"bett\b|\blits?\b|\bcamas?\b|\bletto\b|letti\b|\bbed\b", "bed"),
    (r"tisch\b|\btable\b|\bmesa\b|tavolo|tafel\b", "table"),
    (r"lampe|leuchte|lampara|lampada|\blamp\b|luminaria|candeeiro|abajur", "lamp"),
    (r"pflanze|plantes?\b|planta\b|pianta\b|plant\b|blumen|fleurs|flores|fiori|bloemen", "plant"),
)  # fmt: skip
ABROAD = re.compile(
    r"[^\x00-\x7f]|\b(de|da|del|della|di|du|des|d|la|le|il|para|con|mit|fur|aus|van|met|voor|tv.?mobel|meuble|mueble"
    r"|mobile|movel|meubel)\b",
    re.IGNORECASE,
)


def plain(text: str) -> str:
    """A name in small letters without accents, words apart that it joins by capitals, signs or numbers."""
    apart = re.sub(r"(?<=[a-zà-ÿ])(?=[A-Z])", " ", text)
    bare = unicodedata.normalize("NFKD", apart).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z']+", " ", bare).strip()


def english(text: str) -> str:
    """The English name of a piece of furniture with a name in one of the languages, "" where there is none."""
    name = plain(text)
    return next((word for pattern, word in WORDS if re.search(pattern, name)), "")


def from_abroad(text: str) -> bool:
    """Whether a name looks like none of English words, so that it is looked up here first."""
    return bool(ABROAD.search(text))
